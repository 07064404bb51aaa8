"""Charts of how target and camera moved through the world, and what a filter believed."""

import numpy as np

from vergence.app.figures.chart import Chart, Curve, Panel
from vergence.arrays import FloatArray, IntArray
from vergence.runtime.results import CameraTrace, TargetTrace


def target_chart(trace: CameraTrace, estimate: TargetTrace | None) -> Chart | None:
    """Draw how the target moved from where it was first, and what a filter believed, if it did."""
    known = np.isfinite(trace.T_world_target[:, 0, 0])
    if not known.any():
        return None
    place = trace.T_world_target[known, :3, 3]
    if estimate is None and (place == place[:1]).all():
        return None
    curves = _axes(trace.time[known], place - place[0])
    if estimate is not None:
        believed = estimate.T_world_target[:, :3, 3] - place[0]
        curves += tuple(
            Curve(f"{axis} estimated", estimate.time, believed[:, index], index, "dotted")
            for index, axis in enumerate("xyz")
        )
    return _chart(Panel("target moved by (m, world axes)", curves))


def camera_chart(trace: CameraTrace) -> Chart | None:
    """Draw how a camera moved from where it was first; nothing if it did not."""
    known = np.isfinite(trace.T_world_camera[:, 0, 0])
    place = trace.T_world_camera[known, :3, 3]
    if (place == place[:1]).all():
        return None
    return _chart(
        Panel("camera moved by (m, world axes)", _axes(trace.time[known], place - place[0]))
    )


def estimate_chart(trace: CameraTrace, estimate: TargetTrace | None) -> Chart | None:
    """Draw the error of a filter's target and its stated standard deviation."""
    known = np.isfinite(trace.T_world_target[:, 0, 0])
    if estimate is None or not known.any():
        return None
    true = trace.T_world_target[known][_nearest(trace.time[known], estimate.time)]
    believed = estimate.T_world_target
    distance = np.linalg.norm(believed[:, :3, 3] - true[:, :3, 3], axis=1)
    angle = _angles(np.swapaxes(true[:, :3, :3], 1, 2) @ believed[:, :3, :3])
    rows = (
        ("position (mm)", 1e3 * distance, 1e3 * _spread(estimate, slice(0, 3))),
        ("rotation (°)", np.degrees(angle), np.degrees(_spread(estimate, slice(3, 6)))),
    )
    return _chart(
        *(
            Panel(
                f"error of the estimated target: {title}",
                (
                    Curve("error", estimate.time, error),
                    Curve("1 σ, as stated by the filter", estimate.time, spread, 1, "dashed"),
                ),
                low=0.0,
            )
            for title, error, spread in rows
        )
    )


def pose_error_chart(trace: CameraTrace) -> Chart | None:
    """Draw how far the target truly is from its desired pose in a camera."""
    known = np.isfinite(trace.T_camera_target_desired[:, 0, 0])
    known &= np.isfinite(trace.T_world_target[:, 0, 0])
    if not known.any():
        return None
    desired = trace.T_camera_target_desired[known]
    seen = np.linalg.inv(trace.T_world_camera[known]) @ trace.T_world_target[known]
    distance = np.linalg.norm(seen[:, :3, 3] - desired[:, :3, 3], axis=1)
    angle = _angles(np.swapaxes(desired[:, :3, :3], 1, 2) @ seen[:, :3, :3])
    rows = (("position (mm)", 1e3 * distance), ("rotation (°)", np.degrees(angle)))
    return _chart(
        *(
            Panel(
                f"distance from the desired pose: {title}",
                (Curve("", trace.time[known], values),),
                low=0.0,
            )
            for title, values in rows
        )
    )


def _chart(*panels: Panel) -> Chart:
    return Chart(panels, x_high=float(panels[0].curves[0].x[-1]) or 1.0)


def _axes(time: FloatArray, places: FloatArray) -> tuple[Curve, ...]:
    return tuple(
        Curve.numbered(index, axis, time, places[:, index]) for index, axis in enumerate("xyz")
    )


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
