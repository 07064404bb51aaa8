"""Random starts of an arm from which the camera sees the target."""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell import Cell, SimulatedDriver
from vergence.errors import InputError
from vergence.runtime.campaign.aim import Aim, merged
from vergence.runtime.campaign.presets import law_table
from vergence.runtime.campaign.trial import Trial

_MOST_TRIES = 400  # draws for one start


def random_starts(cell: Cell, aim: Aim, count: int, seed: int, spread: float) -> list[FloatArray]:
    """Return joint positions of the task's arm (n,), degrees or m, one a start.

    Each joint is drawn evenly from a share of its range around the cell's own start, until every
    feature is in the picture. A start depends on the seed and its number only.

    Args:
        cell: the cell.
        aim: its features.
        count: how many.
        seed: of the draws.
        spread: share of a joint's range over which starts are spread; half a turn for joints
            without limits, or with a range beyond it.

    Raises:
        InputError: if no start is found from which the camera sees the target.
    """
    name, camera = cell.task.arm, cell.task.camera
    driver = SimulatedDriver(cell.replace(**aim.changes()), images=False)
    try:
        arm, own = driver.arms[name], driver.world.joint_position(name)
        reach = 0.5 * spread * np.minimum(arm.q_max - arm.q_min, np.pi)
        low, high = np.maximum(own - reach, arm.q_min), np.minimum(own + reach, arm.q_max)
        unit = np.where(arm.chain.sliding, 1.0, np.pi / 180)
        starts = []
        for number in range(count):
            rng = np.random.default_rng([seed, number])
            for _ in range(_MOST_TRIES):
                q = rng.uniform(low, high)
                truth = driver.frame_at(camera, name, q).truth
                if truth is not None and truth.visible.all():
                    break
            else:
                given = f"{spread:g}: {_MOST_TRIES} draws, and none of them sees the target"
                raise InputError("spread", "", given, "a smaller share of the joints' range")
            starts.append(np.round(q / unit, 9))
        return starts
    finally:
        driver.close()


def start_trials(
    cell: Cell, laws: Sequence[str], count: int, seed: int, spread: float = 0.2
) -> list[Trial]:
    """Return the trials that hold laws against each other: each law from the same starts.

    All aim at the picture that the cell as it is written aims at.

    Args:
        cell: the cell.
        laws: names, see `law_table`.
        count: how many starts.
        seed: of the starts.
        spread: see `random_starts`.

    Raises:
        InputError: if there is no such law, or nothing to begin with.
    """
    tables = {name: law_table(cell, name) for name in laws}
    aim = Aim.of(cell)
    starts = random_starts(cell, aim, count, seed, spread)
    return [
        Trial(
            f"{law}/{number}",
            merged(
                aim.changes(),
                {"law": table, "arms": {cell.task.arm: {"start_deg": start.tolist()}}},
            ),
            {"law": law, "start": number},
        )
        for law, table in tables.items()
        for number, start in enumerate(starts)
    ]
