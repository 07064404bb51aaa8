"""Figures of how an arm moved."""

from typing import TYPE_CHECKING

import numpy as np

from vergence.app.figures.layout import Panels, panels
from vergence.arrays import BoolArray, FloatArray
from vergence.drawing import LIMIT, curve, legend
from vergence.runtime import ArmInfo
from vergence.runtime.results import ArmTrace

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vergence.robot import Arm


def joints_figure(arm: ArmInfo, trace: ArmTrace) -> Panels | None:
    """Draw joints and their rates as shares of their limits; a limit is at -1 or 1.

    A joint without limits is drawn in half turns.
    """
    if not len(trace.time):
        return None
    out = panels(2)
    position, rate = out.axes
    _curves(position, trace.time, drawn_positions(arm, trace.position), drawn_names(arm))
    _curves(rate, trace.time, trace.velocity / arm.rate_max, arm.names)
    position.set_ylabel("joint position\n(share of its range)")
    rate.set_ylabel("joint rate\n(share of its limit)")
    for axes in out.axes:
        _limits(axes)
    legend(position)
    return out


def twist_figure(trace: ArmTrace) -> Panels | None:
    """Draw the camera twist that the law asked for, in the camera's own frame."""
    if not np.isfinite(trace.v_camera).any():
        return None
    out = panels(2)
    translation, rotation = out.axes
    _curves(translation, trace.time, trace.v_camera[:, :3], ("x", "y", "z"))
    _curves(rotation, trace.time, trace.v_camera[:, 3:], ("x", "y", "z"))
    translation.set_ylabel("camera velocity\n(m/s)")
    rotation.set_ylabel("camera rate of turn\n(rad/s)")
    legend(translation)
    return out


def measures_figure(trace: ArmTrace) -> Panels | None:
    """Draw how far the arm is from singularities and joint limits."""
    known = {
        "manipulability w′\n(SI units)": trace.manipulability,
        "penalty P\n(1 = far from limits)": trace.penalty,
    }
    shown = {label: values for label, values in known.items() if np.isfinite(values).any()}
    if not shown:
        return None
    out = panels(len(shown))
    for index, (axes, (label, values)) in enumerate(zip(out.axes, shown.items(), strict=True)):
        axes.plot(trace.time, values, **curve(index))
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0, top=1.05 * float(np.nanmax(values)))
    return out


def normalized(arm: "ArmInfo | Arm", position: FloatArray) -> FloatArray:
    """Return positions as shares of the range, -1 and 1 at the limits; NaN without limits."""
    limited = _limited(arm)
    low, high = (np.where(limited, limit, np.nan) for limit in (arm.q_min, arm.q_max))
    return np.asarray((2 * position - low - high) / (high - low))


def drawn_positions(arm: "ArmInfo | Arm", position: FloatArray) -> FloatArray:
    """Return positions (…, n) as shares of the range; in half turns, within ±1, without limits."""
    shares = normalized(arm, position)
    half_turns = np.remainder(position + np.pi, 2 * np.pi) / np.pi - 1.0
    return np.where(_limited(arm), shares, half_turns)


def drawn_names(arm: "ArmInfo | Arm") -> tuple[str, ...]:
    """Return the names of joints beside what `drawn_positions` makes of them."""
    shown = zip(arm.names, _limited(arm), strict=True)
    return tuple(name if limited else f"{name} (half turns)" for name, limited in shown)


def _limited(arm: "ArmInfo | Arm") -> BoolArray:
    limited: BoolArray = np.isfinite(arm.q_min) & np.isfinite(arm.q_max)
    return limited


def _curves(axes: "Axes", time: FloatArray, values: FloatArray, names: tuple[str, ...]) -> None:
    for index, name in enumerate(names):
        axes.plot(time, values[:, index], label=name, **curve(index))


def _limits(axes: "Axes") -> None:
    axes.axhspan(-1.25, -1.0, color=LIMIT, alpha=0.10, linewidth=0)
    axes.axhspan(1.0, 1.25, color=LIMIT, alpha=0.10, linewidth=0)
    for limit in (-1.0, 1.0):
        axes.axhline(limit, color=LIMIT, linewidth=1.0)
    axes.set_ylim(-1.25, 1.25)
    axes.set_yticks([-1.0, -0.5, 0.0, 0.5, 1.0])
