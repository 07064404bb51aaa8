"""Joint positions as a cell file gives them."""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.cell.cell import Cell
from vergence.errors import InputError
from vergence.robot import Arm


def joint_positions(cell: Cell, key: str, given: Sequence[float], arm: Arm) -> FloatArray:
    """Return joint positions (n,), rad or m, that a cell file gives in degrees or m.

    Args:
        cell: the cell.
        key: where in its file they stand.
        given: degrees, metres for sliding joints.
        arm: whose joints they are.

    Raises:
        InputError: if their number is wrong or one is outside its limits.
    """
    if len(given) != arm.joint_count:
        raise InputError(
            str(cell.path),
            key,
            f"{len(given)} values",
            f"{arm.joint_count}: {', '.join(arm.names)}",
        )
    unit = np.where(arm.chain.sliding, 1.0, np.pi / 180)
    position = np.array(given) * unit
    for i, joint in enumerate(arm.names):
        if not arm.q_min[i] <= position[i] <= arm.q_max[i]:
            low, high = arm.q_min[i] / unit[i], arm.q_max[i] / unit[i]
            raise InputError(
                str(cell.path), f"{key}[{i}]", given[i], f"{joint} between {low:.6g} and {high:.6g}"
            )
    return frozen(position)
