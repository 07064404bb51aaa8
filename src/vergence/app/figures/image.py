"""Charts of what a camera saw."""

import numpy as np

from vergence.app.figures.chart import Chart, Curve, Marks, Panel
from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.runtime.results import CameraTrace

_MANY = 8  # features that are still distinguished one by one


def error_chart(trace: CameraTrace) -> Chart | None:
    """Draw how far features are from where they should be, and from where they truly are."""
    known = {
        "distance from the desired point (px)": trace.error_px,
        "tracker drift: distance from the true point (px)": trace.drift_px,
    }
    panels = tuple(
        Panel(title, _distances(trace.time, values), low=0.0)
        for title, values in known.items()
        if np.nansum(values) > 0.0
    )
    return Chart(panels, x_high=float(trace.time[-1]) or 1.0) if panels else None


def paths_chart(camera: Camera, trace: CameraTrace) -> Chart | None:
    """Draw the path of each feature through the image, inside the image's frame."""
    if not trace.found.any():
        return None
    paths = np.where(trace.found[..., None], trace.points_px, np.nan)
    few = paths.shape[1] <= _MANY
    curves = tuple(
        Curve.numbered(index, f"feature {index}" if few else "", path[:, 0], path[:, 1])
        for index, path in enumerate(np.swapaxes(paths, 0, 1))
    )
    marks = (
        Marks("start", _edge(paths, 0), "start"),
        Marks("end", _edge(paths, -1), "end"),
        Marks("desired at the end", _edge(trace.desired_px, -1), "desired"),
    )
    panel = Panel("v (px), downwards", curves, marks, image=(camera.width, camera.height))
    return Chart((panel,), x_title="u (px)")


def _distances(time: FloatArray, values: FloatArray) -> tuple[Curve, ...]:
    count = values.shape[1]
    if count <= _MANY:
        return tuple(
            Curve.numbered(index, f"feature {index}", time, values[:, index])
            for index in range(count)
        )
    seen = np.isfinite(values).any(axis=1)
    largest, middle = np.nanmax(values[seen], axis=1), np.nanmedian(values[seen], axis=1)
    return (
        Curve(f"largest of {count}", time[seen], largest, color=1),
        Curve("median", time[seen], middle, color=0),
    )


def _edge(paths: FloatArray, which: int) -> FloatArray:
    """Return the first (0) or last (-1) known place of each point, (P, 2)."""
    known = np.isfinite(paths[..., 0])
    places = [paths[known[:, index], index] for index in range(paths.shape[1])]
    return np.array([place[which] for place in places if len(place)]).reshape(-1, 2)
