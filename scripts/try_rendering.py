"""Renders one tiny image without a screen; exits with 1 and the reason when that fails."""

import os
import sys

os.environ.setdefault("MUJOCO_GL", "egl")

MODEL = """
<mujoco>
  <worldbody>
    <light pos="0 0 2"/>
    <geom type="sphere" size="0.5"/>
    <camera name="eye" pos="0 0 3"/>
  </worldbody>
</mujoco>
"""


def render() -> str | None:
    """Returns why rendering fails, or None."""
    try:
        import mujoco

        model = mujoco.MjModel.from_xml_string(MODEL)
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        with mujoco.Renderer(model, height=32, width=32) as renderer:
            renderer.update_scene(data, camera="eye")
            image = renderer.render()
    except Exception as error:  # whatever the loader of the graphics library raises
        return f"{type(error).__name__}: {error}"
    return None if image.max() > 0 else "the image is black"


if __name__ == "__main__":
    reason = render()
    if reason is not None:
        print(
            f"Cannot render without a screen (MUJOCO_GL={os.environ['MUJOCO_GL']}): {reason}",
            file=sys.stderr,
        )
        sys.exit(1)
