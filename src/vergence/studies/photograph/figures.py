"""What became of trials of photographs, drawn."""

from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any

import numpy as np

from vergence.drawing import COLORS, curve, figure, legend, logarithmic
from vergence.signals import OutcomeKind
from vergence.studies.photograph.methods import Method
from vergence.studies.photograph.trials import SCENES, TrialResult

TOLERANCE_M, TOLERANCE_DEG = 1e-3, 0.2  # of the cell
NEAR_M, NEAR_DEG = 5e-3, 1.0  # of the goal, to be called near it
_WIDTH = 7.6  # inches


class End(Enum):
    """What became of a trial, by where the camera truly ended."""

    WITHIN = "within the tolerance"
    NEAR = f"within {1e3 * NEAR_M:g} mm and {NEAR_DEG:g}°"
    ELSEWHERE = "elsewhere"
    REFUSED = "refused before a move"

    @classmethod
    def of(cls, result: TrialResult) -> "End":
        """Return the end of a trial."""
        if not result.moved:
            return cls.REFUSED
        if result.final_m <= TOLERANCE_M and result.final_deg <= TOLERANCE_DEG:
            return cls.WITHIN
        near = result.final_m <= NEAR_M and result.final_deg <= NEAR_DEG
        return cls.NEAR if near else cls.ELSEWHERE


_COLORS = {
    End.WITHIN: COLORS[2],
    End.NEAR: COLORS[1],
    End.ELSEWHERE: COLORS[3],
    End.REFUSED: "#999999",
}


def errors(results: Sequence[TrialResult]) -> Any:
    """Draw where the camera ended over where it began."""
    drawing, (axes,) = figure(_WIDTH, 3.6)
    for index, scene in enumerate(SCENES):
        reached = [
            r for r in results if r.outcome is OutcomeKind.REACHED and r.trial.scene == scene
        ]
        start = [1e3 * r.start_m for r in reached]
        end = [1e3 * r.final_m for r in reached]
        axes.plot(start, end, "o", color=curve(index)["color"], markersize=4, label=scene)
    axes.axhline(1e3 * TOLERANCE_M, color="#888", linestyle="--")
    logarithmic(axes, "y")
    axes.set_xlabel("distance at the start (mm)")
    axes.set_ylabel("distance at the end (mm)")
    legend(axes)
    return drawing


def ends(found: Mapping[Method, Sequence[TrialResult]]) -> Any:
    """Draw what became of the trials that every method made, a bar a method."""
    names, count = [method.value for method in found], min(map(len, found.values()))
    drawing, (axes,) = figure(_WIDTH, 2.2)
    left = np.zeros(len(names))
    for end, color in _COLORS.items():
        same = [sum(End.of(r) is end for r in some[:count]) for some in found.values()]
        share = 100.0 * np.array(same) / count
        axes.barh(names, share, left=left, label=end.value, color=color, height=0.6)
        left += share
    axes.set_xlabel(f"of {count} trials (%)")
    axes.set_xlim(0, 100)
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    legend(axes)
    return drawing
