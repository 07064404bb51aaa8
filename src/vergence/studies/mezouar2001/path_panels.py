"""Axes of figures that show a path: through the image, through the joints' ranges, in space."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.drawing import COLORS, INK, LIMIT, SETTINGS, curve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FRAMES = 7  # camera frames drawn along a path in space
_MARKED: dict[str, Any] = {"color": "#222", "markersize": 4, "zorder": 3, "linestyle": "none"}


def grid(width: float, height: float, rows: int, columns: int) -> "tuple[Figure, Any]":
    """Return a figure of a size in inches and its axes, (rows, columns)."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(SETTINGS):
        drawn = Figure(figsize=(width, height), layout="constrained")
        axes = drawn.subplots(rows, columns, squeeze=False)
    return drawn, axes


def space(width: float, height: float) -> "tuple[Figure, Any]":
    """Return a figure of a size in inches with one set of axes in space."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(SETTINGS):
        drawn = Figure(figsize=(width, height), layout="constrained")
        axes = drawn.add_subplot(projection="3d")
    return drawn, axes


def draw_image(
    axes: "Axes", camera: Camera, points_px: FloatArray, image: ImageArray | None
) -> None:
    """Draw what the camera saw, its marks (N, 2) numbered; on white if there is no image."""
    _image_frame(axes, camera)
    if image is not None:
        axes.imshow(image, cmap="gray", vmin=0, vmax=255)
        axes.grid(visible=False)
    middle = points_px.mean(axis=0) + 1e-6
    ink = "#ffd400" if image is not None else INK
    if image is None:
        axes.plot(*points_px.T, "o", color=INK, markersize=5)
    for number, (u, v) in enumerate(points_px, start=1):
        outward = np.array([u, v]) - middle
        outward *= 9.0 / np.linalg.norm(outward)
        axes.annotate(
            str(number),
            (u, v),
            (outward[0], -outward[1]),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=7.5,
            color=ink,
        )


def image_paths(axes: "Axes", camera: Camera, points_px: FloatArray) -> None:
    """Draw the path of each point (K, N, 2) px, hollow where it starts and filled at its end."""
    for index in range(points_px.shape[1]):
        axes.plot(*points_px[:, index].T, label=f"point {index}", **curve(index))
    axes.plot(*points_px[0].T, "o", markerfacecolor="white", label="start", **_MARKED)
    axes.plot(*points_px[-1].T, "s", label="goal", **_MARKED)
    _image_frame(axes, camera, points_px)


def joint_paths(
    axes: "Axes",
    along: FloatArray,
    normalized: FloatArray,
    names: Sequence[str],
    label: str = "joint position (share of its range)",
) -> None:
    """Draw joint positions (K, n) with their limits at -1 and 1 over time or place (K,)."""
    for index, name in enumerate(names):
        axes.plot(along, normalized[:, index], label=name, **curve(index))
    reach = max(1.15, 1.05 * float(np.abs(normalized).max()))
    for side in (-1.0, 1.0):
        axes.axhline(side, color=LIMIT, linewidth=1.0)
        axes.axhspan(side, side * reach, color=LIMIT, alpha=0.10, linewidth=0)
    axes.set_ylim(-reach, reach)
    axes.set_yticks([-1.0, -0.5, 0.0, 0.5, 1.0])
    axes.set_xlim(along[0], along[-1])
    axes.set_ylabel(label)


def camera_paths(
    axes: Any, paths: Sequence[tuple[str, FloatArray]], points_world: FloatArray
) -> None:
    """Draw the way of the focal point for each named path (K, 4, 4), and the points (N, 3), m.

    Short strokes show where the camera looks.
    """
    places = [T[:, :3, 3] for _, T in paths]
    everything = np.vstack([*places, points_world])
    low, high = everything.min(axis=0), everything.max(axis=0)
    stroke = 0.12 * float((high - low).max())
    for index, (name, T) in enumerate(paths):
        style = curve(index)
        axes.plot(*T[:, :3, 3].T, label=name, **style)
        for pose in T[np.linspace(0, len(T) - 1, FRAMES).astype(int)]:
            tip = pose[:3, 3] + stroke * pose[:3, 2]
            axes.plot(*np.column_stack((pose[:3, 3], tip)), color=style["color"], linewidth=0.8)
    start, goal = places[0][0], places[0][-1]
    axes.plot(*start[:, None], "o", markerfacecolor="white", label="start", **_MARKED)
    axes.plot(*goal[:, None], "s", label="goal", **_MARKED)
    axes.plot(*points_world.T, ".", color=COLORS[6], linestyle="none", label="object")
    _equal_scale(axes, low - 0.5 * stroke, high + 0.5 * stroke)


def _image_frame(axes: "Axes", camera: Camera, points_px: FloatArray | None = None) -> None:
    """Show the image as the camera has it, v downwards, and as much around it as is needed."""
    from matplotlib.patches import Rectangle

    low, high = np.array([-0.5, -0.5]), np.array([camera.width - 0.5, camera.height - 0.5])
    frame = Rectangle(
        tuple(low), *(high - low), fill=False, edgecolor=LIMIT, linewidth=1.2, zorder=2.5
    )
    axes.add_patch(frame)
    if points_px is not None:
        far = 0.6 * (high - low)  # a point that comes close to the camera goes much farther
        flat = points_px.reshape(-1, 2)
        low = np.maximum(np.minimum(low, flat.min(axis=0)), low - far)
        high = np.minimum(np.maximum(high, flat.max(axis=0)), high + far)
    margin = 0.02 * (high - low)
    axes.set_xlim(low[0] - margin[0], high[0] + margin[0])
    axes.set_ylim(high[1] + margin[1], low[1] - margin[1])
    axes.set_aspect("equal")
    axes.set_xlabel("u (px)")
    axes.set_ylabel("v (px)")


_HIGH_SHARE = 0.6  # height of a box whose labels just fit below it, as a share of its diagonal


def _equal_scale(axes: Any, low: FloatArray, high: FloatArray) -> None:
    """Give a metre the same length along all three axes, ticks at the same distance."""
    from matplotlib.ticker import MultipleLocator

    spans = high - low
    step = next(s for s in (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 1e9) if spans.max() / s <= 8)
    # The box keeps its diagonal: one that is high would reach beyond the figure.
    high_share = spans[2] / np.linalg.norm(spans)
    axes.set_box_aspect(tuple(spans), zoom=min(1.0, _HIGH_SHARE / high_share))
    for name, near, far in zip("xyz", low, high, strict=True):
        getattr(axes, f"set_{name}lim")(near, far)
        getattr(axes, f"set_{name}label")(f"{name} (m)")
        getattr(axes, f"{name}axis").set_major_locator(MultipleLocator(step))
