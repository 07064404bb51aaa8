"""Figures of what a camera saw."""

from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.app.figures.layout import Panels, panels
from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.drawing import COLORS, curve, legend
from vergence.runtime.results import CameraTrace

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MANY = 8  # features that are still told apart one by one


def error_figure(trace: CameraTrace) -> Panels | None:
    """Draw how far features are from where they should be, and from where they truly are."""
    known = {
        "from the desired point (px)": trace.error_px,
        "from the true point (px)": trace.drift_px,
    }
    shown = {label: values for label, values in known.items() if np.nansum(values) > 0.0}
    if not shown:
        return None
    out = panels(len(shown))
    for axes, (label, values) in zip(out.axes, shown.items(), strict=True):
        _distances(axes, trace.time, values)
        axes.set_ylabel("distance\n" + label)
        axes.set_ylim(bottom=0.0)
    legend(out.axes[0])
    return out


def paths_figure(camera: Camera, trace: CameraTrace) -> Panels | None:
    """Draw the way of each feature through the image, inside the image's frame."""
    if not trace.found.any():
        return None
    out = panels(1, "u (px)", height=4.6)
    axes = out.axes[0]
    image_frame(axes, camera)
    paths = np.where(trace.found[..., None], trace.points_px, np.nan)
    few = paths.shape[1] <= _MANY
    for index in range(paths.shape[1]):
        label = f"feature {index}" if few else None
        axes.plot(paths[:, index, 0], paths[:, index, 1], label=label, **curve(index))
    for points, marker, label, style in _ends(trace, paths):
        if len(points):
            axes.plot(points[:, 0], points[:, 1], marker, label=label, **style)
    axes.set_ylabel("v (px)")
    legend(axes)
    return out


def _distances(axes: "Axes", time: FloatArray, values: FloatArray) -> None:
    count = values.shape[1]
    if count <= _MANY:
        for index in range(count):
            axes.plot(time, values[:, index], label=f"feature {index}", **curve(index))
        return
    seen = np.isfinite(values).any(axis=1)
    largest, middle = np.nanmax(values[seen], axis=1), np.nanmedian(values[seen], axis=1)
    axes.plot(time[seen], largest, color=COLORS[1], label=f"largest of {count}")
    axes.plot(time[seen], middle, color=COLORS[0], label="median")


def image_frame(axes: "Axes", camera: Camera) -> None:
    """Show the image as the camera has it: v downwards, pixel centres at integers."""
    from matplotlib.patches import Rectangle

    width, height = camera.width, camera.height
    frame = Rectangle((-0.5, -0.5), width, height, fill=False, edgecolor="#555", linewidth=1.2)
    axes.add_patch(frame)
    margin = 0.02 * width
    axes.set_xlim(-0.5 - margin, width - 0.5 + margin)
    axes.set_ylim(height - 0.5 + margin, -0.5 - margin)
    axes.set_aspect("equal")


def _ends(
    trace: CameraTrace, paths: FloatArray
) -> list[tuple[FloatArray, str, str, dict[str, Any]]]:
    """Return the points to mark, each kind with its marker, name and style."""
    hollow = {"color": "#222", "markerfacecolor": "white", "markersize": 7, "zorder": 3}
    solid = {"color": "#222", "markersize": 5, "zorder": 3}
    desired = {"color": "#222", "markersize": 9, "markeredgewidth": 1.2, "zorder": 4}
    return [
        (_edge(paths, 0), "o", "start", hollow),
        (_edge(paths, -1), "s", "end", solid),
        (_edge(trace.desired_px, -1), "+", "desired at the end", desired),
    ]


def _edge(paths: FloatArray, which: int) -> FloatArray:
    """Return the first (0) or last (-1) known place of each point, (P, 2)."""
    known = np.isfinite(paths[..., 0])
    ways = [paths[known[:, index], index] for index in range(paths.shape[1])]
    return np.array([way[which] for way in ways if len(way)]).reshape(-1, 2)
