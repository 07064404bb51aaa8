"""Figures of a calibration: residuals over the image, and image by image."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vergence.app.figures.layout import Panels, panels
from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.camera.calibration import Sighting
from vergence.camera.calibration.reprojection import rms
from vergence.drawing import COLORS, legend

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ARROW_SHARE = 0.06  # of the image's width: the longest arrow
_MOST_NAMES = 40  # images whose names are written


def residual_field_figure(
    camera: Camera, sightings: Sequence[Sighting], residuals: Sequence[FloatArray]
) -> Panels:
    """Draw every corner where it was found, with its residual as an arrow made longer."""
    out = panels(1, "u (px)", height=5.6)
    axes = out.axes[0]
    _image_frame(axes, camera)
    places = np.concatenate([seen.points_px for seen in sightings])
    arrows = np.concatenate([residual.reshape(-1, 2) for residual in residuals])
    longest = float(np.quantile(np.hypot(*arrows.T), 0.99))
    longer = _round(_ARROW_SHARE * camera.width / max(longest, 1e-9))
    axes.plot(*places.T, ".", color="#999", markersize=2.0, label="corner, as found", zorder=2)
    field = axes.quiver(
        *places.T, *(longer * arrows).T,
        angles="xy", scale_units="xy", scale=1.0, color=COLORS[0], width=1.6e-3, zorder=3,
    )  # fmt: skip
    key = _round(longest)
    axes.quiverkey(
        field, 1.14, 0.78, longer * key, f"{key:g} px,\n{longer:g} × as long", labelpos="S",
        coordinates="axes", fontproperties={"size": 8.5},
    )  # fmt: skip
    axes.set_ylabel("v (px)")
    legend(axes)
    return out


def residual_bars_figure(
    sightings: Sequence[Sighting], residuals: Sequence[FloatArray], left_out_px: FloatArray
) -> Panels:
    """Draw two bars for each image: its residual in the fit, and left out of it.

    Args:
        sightings: of the images.
        residuals: (2n,) of each, px.
        left_out_px: root mean square of each, (N,), px.
    """
    out = panels(1, "image", height=2.6)
    axes = out.axes[0]
    places = np.arange(len(sightings))
    inside = np.array([rms(residual) for residual in residuals])
    for number, (label, heights) in enumerate((("in the fit", inside), ("left out", left_out_px))):
        shifted = places + 0.4 * (number - 0.5)
        axes.bar(shifted, heights, 0.4, label=label, color=COLORS[number], zorder=2)
    step = max(1, -(-len(sightings) // _MOST_NAMES))
    names = [seen.name for seen in sightings]
    axes.set_xticks(places[::step], names[::step], rotation=90, fontsize=7)
    axes.set_ylabel("root mean square\nresidual (px)")
    axes.grid(False, axis="x")
    legend(axes)
    return out


def _image_frame(axes: "Axes", camera: Camera) -> None:
    """Show the image as the camera has it: v downwards, pixel centres at integers."""
    from matplotlib.patches import Rectangle

    width, height = camera.width, camera.height
    frame = Rectangle((-0.5, -0.5), width, height, fill=False, edgecolor="#555", linewidth=1.2)
    axes.add_patch(frame)
    margin = 0.02 * width
    axes.set_xlim(-0.5 - margin, width - 0.5 + margin)
    axes.set_ylim(height - 0.5 + margin, -0.5 - margin)
    axes.set_aspect("equal")


def _round(value: float) -> float:
    """Return the nearest of 1, 2, 5, times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(min((1.0, 2.0, 5.0, 10.0), key=lambda step: abs(step * power - value)) * power)
