"""A film of the robot for a run's report, drawn from the recorded joints."""

from typing import Any

import numpy as np

from vergence.app.first_view import first_view, points_in_view
from vergence.app.recorded_images import MarkedImage
from vergence.app.recorded_poses import RecordedPoses
from vergence.app.recorded_world import RecordedWorld
from vergence.arrays import FloatArray
from vergence.camera.image_file import as_jpeg
from vergence.runtime.recording import Recording
from vergence.simulation.build import under_a_sky
from vergence.simulation.renderer import offscreen

_FRAMES, _PER_SECOND = 24, 5.0  # at most: to draw one takes a processor about 10 ms
_WIDTH_PX, _HEIGHT_PX, _QUALITY = 400, 300, 80


def robot_film(recording: Recording) -> tuple[MarkedImage, ...]:
    """Return images of the cell, evenly over a run; none where its cell or a renderer is missing.

    Arms are where their joints were measured. Targets are where they truly were; where that is not
    known, where a filter believed them, or else where the cell file places them.
    """
    times = _times(recording)
    world = RecordedWorld.of(recording.info) if len(times) else ""
    if isinstance(world, str):
        return ()
    poses = RecordedPoses(recording)
    states, seen = [], []
    for time in times.tolist():
        states.append(world.place(poses.joints(time), poses.targets(time)))
        seen.append(points_in_view(world.world))
    view = first_view(world.world, np.vstack((*seen[1:], seen[0])))
    jpegs = _drawn(under_a_sky(world.world.cell), states, view)
    return tuple(MarkedImage(*frame) for frame in zip(times.tolist(), jpegs, strict=False))


def _times(recording: Recording) -> FloatArray:
    """Return when to draw, s."""
    if not any(len(trace.time) for trace in recording.arms.values()):
        return np.empty(0)
    count = min(_FRAMES, max(2, round(_PER_SECOND * recording.duration)))
    return np.linspace(0.0, recording.duration, count)


def _drawn(model: Any, states: list[FloatArray], view: Any) -> list[bytes]:
    """Draw a model in states of it, as JPEG; nothing without a renderer."""
    import cv2
    import mujoco

    model.vis.global_.offwidth = max(model.vis.global_.offwidth, _WIDTH_PX)
    model.vis.global_.offheight = max(model.vis.global_.offheight, _HEIGHT_PX)
    data, kind = mujoco.MjData(model), int(mujoco.mjtState.mjSTATE_INTEGRATION)
    try:
        renderer = offscreen(model, _HEIGHT_PX, _WIDTH_PX)
    except Exception:  # whatever the graphics library throws
        return []
    jpegs = []
    with renderer:
        for state in states:
            mujoco.mj_setState(model, data, state, kind)
            mujoco.mj_kinematics(model, data)
            mujoco.mj_camlight(model, data)
            renderer.update_scene(data, view)
            drawn = cv2.cvtColor(renderer.render(), cv2.COLOR_RGB2BGR)
            jpegs.append(as_jpeg(drawn, _QUALITY))
    return jpegs
