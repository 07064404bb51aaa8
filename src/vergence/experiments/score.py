"""How laws did, counted."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vergence.experiments.trial import Ending, TrialResult


@dataclass(frozen=True, slots=True)
class Score:
    """How one law did over its starts."""

    law: str
    endings: tuple[int, ...]  # how many trials came to each `Ending`, in its order
    converged_s: float  # median time until it had converged, of those that did; NaN without any
    path_m: float  # median way of the camera, of those that converged; NaN without any

    @property
    def trials(self) -> int:
        """How many trials there were."""
        return sum(self.endings)

    def count(self, ending: Ending) -> int:
        """Return how many trials came to an ending."""
        return self.endings[list(Ending).index(ending)]


def scores(results: Sequence[TrialResult]) -> list[Score]:
    """Return a score for each law, in the order of their first results."""
    laws = dict.fromkeys(str(result.labels["law"]) for result in results)
    return [_score(law, [r for r in results if r.labels["law"] == law]) for law in laws]


def _score(law: str, results: Sequence[TrialResult]) -> Score:
    converged = [result for result in results if result.ending is Ending.CONVERGED]
    times = [result.converged_s for result in converged if result.converged_s is not None]
    return Score(
        law,
        tuple(sum(result.ending is ending for result in results) for ending in Ending),
        float(np.median(times)) if times else float("nan"),
        float(np.median([result.path_m for result in converged])) if converged else float("nan"),
    )
