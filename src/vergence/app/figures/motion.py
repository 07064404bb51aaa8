"""Figures of how target and camera moved through the world, and what a filter believed."""

import numpy as np

from vergence.app.figures.layout import Panels, panels
from vergence.arrays import FloatArray, IntArray
from vergence.drawing import curve, legend
from vergence.runtime.results import CameraTrace, TargetTrace


def target_figure(trace: CameraTrace, estimate: TargetTrace | None) -> Panels | None:
    """Draw how the target moved from where it was first, and what a filter believed, if it did."""
    known = np.isfinite(trace.T_world_target[:, 0, 0])
    if not known.any():
        return None
    place = trace.T_world_target[known, :3, 3]
    if estimate is None and (place == place[:1]).all():
        return None
    out = panels(1)
    axes = out.axes[0]
    for index, axis in enumerate("xyz"):
        axes.plot(trace.time[known], place[:, index] - place[0, index], label=axis, **curve(index))
    if estimate is not None:
        believed = estimate.T_world_target[:, :3, 3] - place[0]
        for index, axis in enumerate("xyz"):
            style = {**curve(index), "linestyle": ":", "linewidth": 2.0}
            axes.plot(estimate.time, believed[:, index], label=f"{axis} estimated", **style)
    axes.set_ylabel("target moved by\n(m, world axes)")
    legend(axes)
    return out


def camera_figure(trace: CameraTrace) -> Panels | None:
    """Draw how a camera moved from where it was first; nothing if it did not."""
    known = np.isfinite(trace.T_world_camera[:, 0, 0])
    place = trace.T_world_camera[known, :3, 3]
    if (place == place[:1]).all():
        return None
    out = panels(1)
    axes = out.axes[0]
    for index, axis in enumerate("xyz"):
        axes.plot(trace.time[known], place[:, index] - place[0, index], label=axis, **curve(index))
    axes.set_ylabel("camera moved by\n(m, world axes)")
    legend(axes)
    return out


def estimate_figure(trace: CameraTrace, estimate: TargetTrace | None) -> Panels | None:
    """Draw how far a filter's target is from the true one, and how far it thinks it might be."""
    known = np.isfinite(trace.T_world_target[:, 0, 0])
    if estimate is None or not known.any():
        return None
    true = trace.T_world_target[known][_nearest(trace.time[known], estimate.time)]
    believed = estimate.T_world_target
    distance = np.linalg.norm(believed[:, :3, 3] - true[:, :3, 3], axis=1)
    angle = _angles(np.swapaxes(true[:, :3, :3], 1, 2) @ believed[:, :3, :3])
    rows = (
        ("position (mm)", 1e3 * distance, 1e3 * _spread(estimate, slice(0, 3))),
        ("rotation (deg)", np.degrees(angle), np.degrees(_spread(estimate, slice(3, 6)))),
    )
    out = panels(2)
    for axes, (label, error, spread) in zip(out.axes, rows, strict=True):
        axes.plot(estimate.time, error, label="error", **curve(0))
        axes.plot(
            estimate.time, spread, label="1 σ, as believed", **{**curve(1), "linestyle": "--"}
        )
        axes.set_ylabel("estimated target\n" + label)
        axes.set_ylim(bottom=0.0)
    legend(out.axes[0])
    return out


def pose_error_figure(trace: CameraTrace) -> Panels | None:
    """Draw how far the target truly is from its desired pose in a camera."""
    known = np.isfinite(trace.T_camera_target_desired[:, 0, 0])
    known &= np.isfinite(trace.T_world_target[:, 0, 0])
    if not known.any():
        return None
    desired = trace.T_camera_target_desired[known]
    seen = np.linalg.inv(trace.T_world_camera[known]) @ trace.T_world_target[known]
    distance = np.linalg.norm(seen[:, :3, 3] - desired[:, :3, 3], axis=1)
    angle = _angles(np.swapaxes(desired[:, :3, :3], 1, 2) @ seen[:, :3, :3])
    out = panels(2)
    rows = (("position (mm)", 1e3 * distance), ("rotation (deg)", np.degrees(angle)))
    for axes, (label, values) in zip(out.axes, rows, strict=True):
        axes.plot(trace.time[known], values, **curve(0))
        axes.set_ylabel("off the desired pose\n" + label)
        axes.set_ylim(bottom=0.0)
    return out


def _nearest(times: FloatArray, desired: FloatArray) -> IntArray:
    """Return the row of the time nearest to each desired one."""
    return np.asarray(np.abs(times[None, :] - desired[:, None]).argmin(axis=1))


def _angles(rotations: FloatArray) -> FloatArray:
    """Return the angle of each rotation (K, 3, 3), rad, exact near zero as well."""
    skew = rotations - np.swapaxes(rotations, 1, 2)
    sine = np.sqrt(skew[:, 2, 1] ** 2 + skew[:, 0, 2] ** 2 + skew[:, 1, 0] ** 2)
    return np.asarray(np.arctan2(sine, np.trace(rotations, axis1=1, axis2=2) - 1.0))


def _spread(estimate: TargetTrace, part: slice) -> FloatArray:
    """Return the standard deviation of a distance, the square root of a covariance's trace."""
    return np.asarray(np.sqrt(np.trace(estimate.covariance[:, part, part], axis1=1, axis2=2)))
