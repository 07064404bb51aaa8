"""Trials that hold laws against each other."""

from collections.abc import Sequence

from vergence.cell import Cell
from vergence.experiments.goal import Goal, merged
from vergence.experiments.presets import law_table
from vergence.experiments.sampling import Sampling
from vergence.experiments.trial import Trial


def start_trials(
    cell: Cell, laws: Sequence[str], count: int, seed: int, sampling: Sampling | None = None
) -> list[Trial]:
    """Return the trials that hold laws against each other: each law from the same draws.

    All aim at the image, or the pose, that the cell as it is written aims at.

    Args:
        cell: the cell.
        laws: names, see `law_table`.
        count: how many draws.
        seed: of them.
        sampling: what is drawn; the arm's starts if None.

    Raises:
        InputError: if there is no such law, or nothing to begin with.
    """
    tables = {name: law_table(cell, name) for name in laws}
    goal = Goal.of(cell)
    drawn = (sampling or Sampling()).changes(cell, goal, count, seed)
    return [
        Trial(
            f"{law}/{number}",
            merged(goal.tables, {"law": table}, changes),
            {"law": law, "start": number},
        )
        for law, table in tables.items()
        for number, changes in enumerate(drawn)
    ]
