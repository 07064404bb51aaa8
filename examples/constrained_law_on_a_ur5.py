"""Servo a UR5 towards an image beyond its view limit, without limits and with them.

The four points are desired beyond the border of the image. The pseudo-inverse goes there and loses
them; the quadratic program stops at the border, and its recording says which limit held it back.
Needs the arm's model: pip install 'vergence[arms]'
"""

from pathlib import Path

import numpy as np

from vergence.cell import load_cell
from vergence.control import ImageBased, Law, Limits, PseudoInverse, Servo
from vergence.planning import FixedReference
from vergence.runtime import Loop, Recorder, Recording, RunInfo
from vergence.signals import Reference
from vergence.simulation import ExactPoints, SimulatedDriver

MARGIN_PX = 20.0
BEYOND_PX = np.array([320.0, 60.0])  # offset of the desired points


def servo(driver: SimulatedDriver, law: Law, desired_px: np.ndarray, folder: Path) -> Recording:
    """Run a law for five seconds and return what was recorded."""
    recorder = Recorder(folder)
    recorder.begin(RunInfo.of(driver, "ur5", driver.cell.text, driver.cell.seed, "wrist"))
    goal = FixedReference(Reference(0.0, desired_px))
    loop = Loop(
        driver, "ur5", ExactPoints("wrist"), goal, law, outer_rate_hz=30, listeners=[recorder]
    )
    recorder.close(loop.run(duration_s=5.0), {})
    driver.close()
    return Recording.open(folder)


def main() -> None:
    for name in ("plain", "constrained"):
        driver = SimulatedDriver(
            load_cell("ur5", {"target.motion": '{ kind = "stationary" }'}), images=False
        )
        arm, camera = driver.world.arm_to_camera("wrist"), driver.cameras["wrist"]
        truth = driver.first_frame("wrist").truth
        assert truth is not None
        objective = ImageBased(gain=2.0)
        if name == "plain":
            law = Servo(arm, camera, objective, solver=PseudoInverse(), depth_m=truth.depth_m)
        else:
            limits = Limits(
                order=("view", "singularity", "joint margin"),  # highest priority first
                view_margin_px=MARGIN_PX,
                manipulability_share=0.5,
                depth_range=(0.7, 1.4),  # true over believed depth
            )
            law = Servo(arm, camera, objective, limits=limits, depth_m=truth.depth_m)
        run = servo(driver, law, truth.points_px + BEYOND_PX, Path("runs") / f"ur5-{name}")
        seen = run.cameras["wrist"].points_px
        lost = np.count_nonzero(np.isnan(seen[:, :, 0]).any(axis=0))
        room = np.minimum(seen, np.array([camera.width, camera.height]) - 1 - seen)
        shaped = {what for tick in run.arms["ur5"].active for what in tick}
        print(f"{name}: {run.outcome}")
        print(f"  {lost} of {len(truth.points_px)} points were lost; ", end="")
        print(f"the rest stayed {np.nanmin(room):.0f} px or more from the border")
        print(f"  shaped by: {', '.join(sorted(shaped)) or 'nothing'}")
        print(f"  vergence report {run.folder}")


if __name__ == "__main__":
    main()
