"""The figure of how target and camera moved through the world."""

import numpy as np

from vergence.app.figures.layout import Panels, panels
from vergence.drawing import curve, legend
from vergence.runtime.recording import CameraTrace, TargetTrace


def motion_figure(trace: CameraTrace, estimate: TargetTrace | None) -> Panels | None:
    """Draw target and camera from where they began; the filter's belief of the target dotted."""
    known = np.isfinite(trace.T_world_camera[:, 0, 0])
    if not known.any():
        return None
    out = panels(2)
    time = trace.time[known]
    places = [pose[known, :3, 3] for pose in (trace.T_world_target, trace.T_world_camera)]
    for axes, place, name in zip(out.axes, places, ("target", "camera"), strict=True):
        moved = place - place[0]
        for index, axis in enumerate("xyz"):
            axes.plot(time, moved[:, index], label=axis, **curve(index))
        axes.set_ylabel(f"{name} moved by\n(m, world axes)")
    if estimate is not None:
        believed = estimate.T_world_target[:, :3, 3] - places[0][0]
        for index, axis in enumerate("xyz"):
            style = {**curve(index), "linestyle": ":", "linewidth": 2.0}
            out.axes[0].plot(estimate.time, believed[:, index], label=f"{axis} estimated", **style)
    legend(out.axes[0])
    return out
