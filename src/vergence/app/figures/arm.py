"""Charts of how an arm moved."""

from typing import TYPE_CHECKING

import numpy as np

from vergence.app.figures.chart import Chart, Curve, Panel
from vergence.arrays import BoolArray, FloatArray
from vergence.runtime import ArmInfo
from vergence.runtime.results import ArmTrace

if TYPE_CHECKING:
    from vergence.robot import Arm

CLEAR_OF = {  # what the keys of `ArmTrace.clearance` mean
    "self": "itself", "arms": "other arms", "fixtures": "fixtures", "target": "the target",
}  # fmt: skip
_BEYOND = 1.25  # how far the axis of a limited share reaches


def joints_chart(arm: ArmInfo, trace: ArmTrace) -> Chart | None:
    """Draw joints and their rates as shares of their limits; a limit is at -1 or 1.

    A joint without limits is drawn in degrees, as it turns on past half a turn.
    """
    if not len(trace.time):
        return None
    limited = _limited(arm)
    shares = normalized(arm, trace.position)
    turned = np.degrees(_unwrapped(trace.position))
    rates = trace.velocity / arm.rate_max
    panels = [
        _shares("joint position (share of its range, limits at ±1)", arm, trace, shares, limited),
        Panel("position of a joint without limits (°)", _curves(arm, trace, turned, ~limited)),
        _shares("joint rate (share of its limit)", arm, trace, rates, np.isfinite(arm.rate_max)),
    ]
    return _over_time(trace, [panel for panel in panels if panel.curves])


def twist_chart(trace: ArmTrace) -> Chart | None:
    """Draw the camera twist that the law asked for, in the camera's own frame."""
    if not np.isfinite(trace.v_camera).any():
        return None
    rows = (("camera velocity (m/s)", 0), ("camera angular velocity (rad/s)", 3))
    panels = [
        Panel(
            title,
            tuple(
                Curve.numbered(index, axis, trace.time, trace.v_camera[:, first + index])
                for index, axis in enumerate("xyz")
            ),
        )
        for title, first in rows
    ]
    return _over_time(trace, panels)


def measures_chart(trace: ArmTrace) -> Chart | None:
    """Draw how far the arm is from singularities and joint limits."""
    measure = trace.manipulability
    first = measure[np.isfinite(measure) & (measure > 0.0)][:1]
    known = {
        "manipulability w′ (share of its value at the start)": measure / first
        if len(first)
        else np.full_like(measure, np.nan),
        "joint limit clearance P (1 = far from every limit, 0 = at one)": trace.penalty,
    }
    panels = [
        Panel(title, (Curve("", trace.time, values),), low=0.0)
        for title, values in known.items()
        if np.isfinite(values).any()
    ]
    return _over_time(trace, panels) if panels else None


def clearance_chart(trace: ArmTrace) -> Chart | None:
    """Draw how far the arm is from what it must not touch, where that is near."""
    kinds = [kind for kind in CLEAR_OF if any(kind in tick for tick in trace.clearance)]
    curves = tuple(
        Curve.numbered(index, f"to {CLEAR_OF[kind]}", trace.time, 1e3 * clearance(trace, kind))
        for index, kind in enumerate(kinds)
    )
    return _over_time(trace, [Panel("least distance (mm)", curves, low=0.0)]) if curves else None


def clearance(trace: ArmTrace, kind: str) -> FloatArray:
    """Return the least distance to a kind of thing, (K,), m; NaN where none is near."""
    return np.array([tick.get(kind, np.nan) for tick in trace.clearance])


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


def _unwrapped(position: FloatArray) -> FloatArray:
    """Return positions (K, n) without the jumps of joints that are measured within one turn."""
    return np.asarray(np.unwrap(position, axis=0))


def _curves(
    arm: ArmInfo, trace: ArmTrace, values: FloatArray, drawn: BoolArray
) -> tuple[Curve, ...]:
    return tuple(
        Curve.numbered(index, name, trace.time, values[:, index])
        for index, name in enumerate(arm.names)
        if drawn[index]
    )


def _shares(
    title: str, arm: ArmInfo, trace: ArmTrace, values: FloatArray, drawn: BoolArray
) -> Panel:
    curves = _curves(arm, trace, values, drawn)
    return Panel(title, curves, low=-_BEYOND, high=_BEYOND, limits=(-1.0, 1.0))


def _over_time(trace: ArmTrace, panels: list[Panel]) -> Chart:
    return Chart(tuple(panels), x_high=float(trace.time[-1]) or 1.0)
