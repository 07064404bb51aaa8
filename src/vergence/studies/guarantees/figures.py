"""Figures of the guarantees: how random runs end, and the path through a singularity."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from vergence.arrays import FloatArray
from vergence.drawing import COLORS, curve, figure, legend
from vergence.signals import OutcomeKind
from vergence.studies.check import Figure
from vergence.studies.ending_bars import ending_bars
from vergence.studies.figure_files import save_figures
from vergence.studies.guarantees.laws import LAWS
from vergence.studies.guarantees.random_runs import Pair, endings

_WIDTH = 7.6  # inches
# Of the commonest endings, as in the bars of the other figure; further ones take what is left.
_COLORS = {
    OutcomeKind.COMPLETED.value: COLORS[2],
    OutcomeKind.TARGET_LOST.value: COLORS[1],
    OutcomeKind.JOINT_LIMIT.value: COLORS[5],
}
_FURTHER = tuple(color for color in COLORS if color not in _COLORS.values())


def draw(
    out: Path, ends: Counter[tuple[str, str]], singular: FloatArray, pairs: Sequence[Pair]
) -> tuple[Figure, ...]:
    """Write the figures into a folder.

    Args:
        out: the folder.
        ends: how many runs of a law ended how.
        singular: rows of time (s), smallest singular value, error (px), (K, 3).
        pairs: random starts and goals on the gantry.
    """
    drawn = {
        "ends": (_ends(ends), "How random runs end, law by law."),
        "random": (
            _random(pairs),
            "How runs from random starts to random goals on the gantry end: plain laws, and laws "
            "constrained by view and joint limits.",
        ),
        "singularity": (_singular(singular), "Following a target through the wrist's singularity."),
    }
    return save_figures(out, drawn)


def _ends(ends: Counter[tuple[str, str]]) -> Any:
    laws = sorted({law for law, _ in ends})
    kinds = sorted(
        {kind for _, kind in ends}, key=lambda kind: -sum(ends[law, kind] for law in laws)
    )
    drawing, (axes,) = figure(_WIDTH, 0.5 * len(laws) + 1.1)
    left = [0.0] * len(laws)
    further = iter(_FURTHER * len(kinds))
    for kind in kinds:
        total = [sum(ends[law, other] for other in kinds) for law in laws]
        share = [100.0 * ends[law, kind] / n for law, n in zip(laws, total, strict=True)]
        color = _COLORS.get(kind) or next(further)
        axes.barh(laws, share, left=left, label=kind, color=color, height=0.6)
        left = [a + b for a, b in zip(left, share, strict=True)]
    axes.set_xlabel("runs (%)")
    axes.set_xlim(0, 100)
    axes.grid(visible=False, axis="y")
    legend(axes)
    return drawing


def _random(pairs: Sequence[Pair]) -> Any:
    drawing, (axes,) = figure(_WIDTH, 3.6)
    names = [", ".join(part for part in law if part) for law in LAWS]
    ending_bars(axes, names, [endings(pairs, law) for law in LAWS])
    feasible = sum(not pair.infeasible for pair in pairs)
    axes.set_xlabel(f"of the {feasible} pairs of {len(pairs)} not proved infeasible (%)")
    legend(axes)
    return drawing


def _singular(singular: FloatArray) -> Any:
    drawing, (upper, lower) = figure(_WIDTH, 4.2, rows=2, sharex=True)
    upper.plot(singular[:, 0], singular[:, 1], **curve(0))
    upper.set_ylabel("smallest singular\nvalue of J")
    lower.plot(singular[:, 0], singular[:, 2], **curve(1))
    lower.set_ylabel("largest feature\nerror (px)")
    lower.set_xlabel("time (s)")
    for axes in (upper, lower):
        axes.set_ylim(bottom=0.0)
    return drawing
