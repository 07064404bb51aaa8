"""Trials that tell how far and which way a law follows the target."""

from typing import Any

import numpy as np

from vergence.cell import Cell
from vergence.errors import InputError
from vergence.experiments.goal import Goal, listed, merged
from vergence.experiments.presets import OWN, law_table
from vergence.experiments.trial import Trial

_SETTLE_S = 2.0  # after the target has arrived


def place_trials(
    cell: Cell, extent_m: float, steps: int, speed_m_s: float, law: str = OWN
) -> list[Trial]:
    """Return trials in which the target goes from its place to each point of a level square.

    Where the task is to reach, the target is at each point instead, from the start on.

    Args:
        cell: the cell.
        extent_m: how far the square reaches to each side.
        steps: points along a side.
        speed_m_s: of the target.
        law: see `law_table`.
    """
    fixed, reaching = _fixed(cell, law), cell.task.kind == "reach"
    marks = np.linspace(-extent_m, extent_m, steps)
    return [
        Trial(
            f"{law}/place/{i}/{j}",
            merged(fixed, _standing(cell, x, y) if reaching else _going(x, y, speed_m_s)),
            {
                "law": law,
                "x_m": round(float(x), 9),
                "y_m": round(float(y), 9),
                "speed_m_s": speed_m_s,
            },
        )
        for j, y in enumerate(marks)
        for i, x in enumerate(marks)
    ]


def heading_trials(
    cell: Cell, distance_m: float, headings: int, speeds_m_s: tuple[float, ...], law: str = OWN
) -> list[Trial]:
    """Return trials in which the target leaves its place in each direction, at each speed.

    Args:
        cell: the cell.
        distance_m: how far it goes.
        headings: how many directions, evenly around.
        speeds_m_s: its speeds.
        law: see `law_table`.

    Raises:
        InputError: if the task is to reach a stationary target.
    """
    if cell.task.kind == "reach":
        raise InputError("over", "", "headings, but the task is to reach", "places")
    fixed = _fixed(cell, law)
    trials = []
    for speed in speeds_m_s:
        for k in range(headings):
            angle = 2 * np.pi * k / headings
            x, y = distance_m * np.cos(angle), distance_m * np.sin(angle)
            labels = {
                "law": law,
                "heading_deg": 360.0 * k / headings,
                "speed_m_s": speed,
                "distance_m": distance_m,
            }
            key = f"{law}/heading/{speed:g}/{k}"
            trials.append(Trial(key, merged(fixed, _going(x, y, speed)), labels))
    return trials


def _fixed(cell: Cell, law: str) -> dict[str, Any]:
    return merged(dict(Goal.of(cell).tables), {"law": law_table(cell, law)})


def _standing(cell: Cell, x: float, y: float) -> dict[str, Any]:
    place = listed(np.add(cell.target.position_m, (x, y, 0.0)))
    return {"target": {"position_m": place}}


def _going(x: float, y: float, speed: float) -> dict[str, Any]:
    """Return the motion to an offset in the world's x-y plane, and the time it takes."""
    distance = float(np.hypot(x, y))
    if distance < 1e-9:
        return {"target": {"motion": {"kind": "stationary"}}, "duration_s": _SETTLE_S}
    velocity = [round(speed * float(along) / distance, 9) for along in (x, y)] + [0.0]
    motion = {"kind": "line", "velocity_m_s": velocity, "distance_m": round(distance, 9)}
    duration = round(distance / speed + _SETTLE_S, 6)
    return {"target": {"motion": motion}, "duration_s": duration}
