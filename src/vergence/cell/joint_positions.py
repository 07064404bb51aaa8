"""Joint positions, rates and accelerations as a cell file gives them.

In every key of joints in `_deg`, `_deg_s` or `_deg_s2`, the number of a sliding joint is in
m, m/s or m/s².
"""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.cell.cell import Cell
from vergence.cell.schema import ReachTable
from vergence.errors import NOTHING, InputError
from vergence.robot import Arm

_ROUNDING = 1e-3  # of a limit written with few digits


def joint_positions(cell: Cell, key: str, given: Sequence[float], arm: Arm) -> FloatArray:
    """Return joint positions (n,), rad or m, that a cell file gives in degrees or m.

    Args:
        cell: the cell.
        key: where they are in its file.
        given: degrees, metres for sliding joints.
        arm: whose joints they are.

    Raises:
        InputError: if their number is wrong or one is outside its limits.
    """
    position, unit = _in_si(cell, key, given, arm), _unit(arm)
    for i, joint in enumerate(arm.names):
        if not arm.q_min[i] <= position[i] <= arm.q_max[i]:
            low, high = arm.q_min[i] / unit[i], arm.q_max[i] / unit[i]
            raise InputError(
                str(cell.path), f"{key}[{i}]", given[i], f"{joint} between {low:.6g} and {high:.6g}"
            )
    return frozen(position)


def goal_positions(cell: Cell, arm: Arm) -> FloatArray:
    """Return the joint positions (n,) at which the desired image of `reach` was taken.

    Raises:
        InputError: if the file does not say, or they are not the arm's.
    """
    given = cell.task.goal_deg if isinstance(cell.task, ReachTable) else None
    if given is None:
        allowed = "the joints at which the desired image was taken"
        raise InputError(str(cell.path), "task.goal_deg", NOTHING, allowed)
    return joint_positions(cell, "task.goal_deg", given, arm)


def joint_rates(cell: Cell, name: str, arm: Arm, most: FloatArray) -> FloatArray:
    """Return the rate limits (n,) of an arm, rad/s or m/s: the model's unless the file is tighter.

    Args:
        cell: the cell.
        name: of the arm in it.
        arm: with the rate limits that hold where the file has none.
        most: velocity limits of the model, (n,), inf where it has none.

    Raises:
        InputError: if their number is wrong, or one is looser than the model's.
    """
    key = f"arms.{name}.rate_max_deg_s"
    given = cell.arms[name].rate_max_deg_s
    if given is None:
        return arm.rate_max
    rates, unit = _in_si(cell, key, given, arm), _unit(arm)
    for i, joint in enumerate(arm.names):
        if rates[i] > most[i] * (1 + _ROUNDING):
            where = f"{key}[{i}]" if isinstance(given, Sequence) else key
            per = "m/s" if arm.sliding[i] else "deg/s"
            limit = (
                f"up to {most[i] / unit[i]:.6g} {per}, the velocity limit of {joint} in its model"
            )
            raise InputError(str(cell.path), where, f"{rates[i] / unit[i]:g}", limit)
    return np.minimum(rates, most)


def joint_accelerations(cell: Cell, name: str, arm: Arm) -> FloatArray:
    """Return the acceleration limits (n,) of an arm, rad/s² or m/s².

    Raises:
        InputError: if their number is wrong.
    """
    given = cell.arms[name].acceleration_max_deg_s2
    if given is None:
        return arm.acceleration_max
    return _in_si(cell, f"arms.{name}.acceleration_max_deg_s2", given, arm)


def _unit(arm: Arm) -> FloatArray:
    unit: FloatArray = np.where(arm.sliding, 1.0, np.pi / 180)
    return unit


def _in_si(cell: Cell, key: str, given: float | Sequence[float], arm: Arm) -> FloatArray:
    """Return numbers of a cell file in rad or m, one per joint."""
    if isinstance(given, Sequence):
        numbers, count = np.array(given, dtype=np.float64), f"{len(given)} values"
    else:
        mixed = bool(arm.sliding.any() and not arm.sliding.all())
        numbers, count = np.full(1 if mixed else arm.joint_count, given), "one number for all"
    if len(numbers) != arm.joint_count:
        kinds = (
            f"{n} (slides)" if slides else n
            for n, slides in zip(arm.names, arm.sliding, strict=True)
        )
        allowed = f"{arm.joint_count}: {', '.join(kinds)}"
        raise InputError(str(cell.path), key, count, allowed)
    return frozen(numbers * _unit(arm))
