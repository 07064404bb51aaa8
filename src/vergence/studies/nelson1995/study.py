"""[Nelson1995] section 5: tracking with and without avoidance, and the limits of the method."""

from pathlib import Path

import numpy as np

from vergence.cell import load_cell
from vergence.signals import OutcomeKind
from vergence.studies.check import Check, Progress, StudyResult, within
from vergence.studies.nelson1995 import figures
from vergence.studies.nelson1995.limits import headings, misprint, speed, stability
from vergence.studies.nelson1995.runs import RANGE_M, STRATEGIES, WINDOW_PX, moving, run
from vergence.studies.nelson1995.trial import Trial, Trials
from vergence.studies.rendered import with_imaging

NOISE_PX = 0.05  # of the exact projections of a quick study
TITLE = "Nelson and Khosla (1995): singularity and joint limit avoidance while tracking"


def reproduce(
    out: Path, quick: bool, progress: Progress, seed: int = 0, imaging: str | None = None
) -> StudyResult:
    """Run section 5 and what follows from it; write the figures.

    Args:
        out: folder for the figures.
        quick: exact projections with noise instead of rendered images.
        progress: called with the current step.
        seed: of the cell.
        imaging: of the camera, see `ImagingTable`.
    """
    cell = with_imaging(load_cell("puma560", seed=seed), imaging)
    if quick:
        cell = cell.replace(task={"noise_px": NOISE_PX})
    trials = {}
    for i, (strategy, law) in enumerate(STRATEGIES.items()):
        for j, sign in enumerate((1, -1)):
            progress(
                f"{strategy.replace('_', ' ')}, {'+x' if sign > 0 else '-x'}", (2 * i + j) / 50
            )
            trials[strategy, sign] = run(moving(cell.replace(law=law), sign), quick)
    checks = [
        *_two_axis(trials),
        *_four_axis(trials),
        *_avoidance(trials, quick),
        *_figure15(trials),
        misprint(cell, quick),
        *stability(cell, quick, progress),
        headings(cell, quick, progress),
        *speed(cell, quick, progress),
    ]
    progress("figures", 0.9)
    drawn = figures.draw(out, cell, trials)
    return StudyResult(TITLE, tuple(checks), drawn, seed)


def _two_axis(trials: Trials) -> list[Check]:
    plus, minus = trials["two_axis", 1], trials["two_axis", -1]
    stop_plus, stop_minus = plus.camera_m[-1], -minus.camera_m[-1]
    singular = plus.outcome.kind is OutcomeKind.SINGULARITY
    joint1 = minus.outcome.kind is OutcomeKind.JOINT_LIMIT and "joint1" in minus.outcome.reason
    return [
        Check(
            "two_axis.stop_plus_m",
            "0.53, a singularity",
            stop_plus,
            "m",
            within(stop_plus, 0.47, 0.59) and singular,
            plus.outcome.reason,
            "0.47 to 0.59",
        ),
        Check(
            "two_axis.stop_minus_m",
            "0.40, joint 1",
            stop_minus,
            "m",
            within(stop_minus, 0.35, 0.45) and joint1,
            minus.outcome.reason,
            "0.35 to 0.45",
        ),
        Check(
            "two_axis.range_m",
            "0.94",
            stop_plus + stop_minus,
            "m",
            within(stop_plus + stop_minus, 0.84, 1.04),
            bound="0.84 to 1.04",
        ),
    ]


def _four_axis(trials: Trials) -> list[Check]:
    two, four = (
        sum(abs(trials[strategy, sign].object_m[-1]) for sign in (1, -1))
        for strategy in ("two_axis", "four_axis")
    )
    ends = "; ".join(str(trials["four_axis", sign].outcome) for sign in (1, -1))
    return [
        Check(
            "four_axis.range_ratio",
            "approximately twice as far",
            four / two,
            "",
            within(four / two, 1.6, 2.8),
            ends,
            "1.6 to 2.8",
        )
    ]


def _avoidance(trials: Trials, quick: bool) -> list[Check]:
    both = [trials["avoidance", sign] for sign in (1, -1)]
    completed = all(trial.outcome.succeeded for trial in both)
    distance = sum(float(np.abs(trial.object_m).max()) for trial in both)
    worst = max(trial.summary["max_error_px"] for trial in both)
    ratio = min(trial.summary["min_manipulability_ratio"] for trial in both)
    penalty = min(trial.summary["min_penalty"] for trial in both)
    final = max(float(trial.error_px[-1]) for trial in both)
    drift = max(float(np.nanmax(trial.drift_px)) for trial in both)
    return [
        Check(
            "avoidance.range_m",
            "5.0, both directions",
            distance,
            "m",
            completed and distance > 2 * RANGE_M - 1e-6 and worst <= WINDOW_PX,
            f"largest error {worst:.1f} px",
            f"all, never more than {WINDOW_PX:g} px from where it should be",
        ),
        Check(
            "avoidance.min_manipulability_ratio",
            "remains high",
            ratio,
            "",
            within(ratio, 0.25),
            bound="at least 0.25 of the start",
        ),
        Check(
            "avoidance.min_penalty",
            "kept from going to zero",
            penalty,
            "",
            within(penalty, 0.2),
            bound="at least 0.2",
        ),
        Check(
            "avoidance.final_error_px",
            "reduced to zero when the object stops",
            final,
            "px",
            within(final, 0.0, 0.5),
            bound="at most 0.5",
        ),
        Check(
            "avoidance.drift_max_px",
            "not in the paper: tracked against truly projected point",
            drift,
            "px",
            within(drift, 0.0, 1.0),
            "exact projections: noise, nothing drifts" if quick else "",
            "at most 1",
        ),
    ]


def _figure15(trials: Trials) -> list[Check]:
    """Compare errors over time for the motion along -x, as Fig. 15 does."""
    two, four = trials["two_axis", -1], trials["avoidance", -1]
    slow, quick_ = (_middle_error(trial, 1.0, 3.5) for trial in (two, four))
    early, late = _middle_error(four, 3.0, 8.0), _middle_error(four, 20.0, 25.0)
    end = float(two.camera.time[-1])
    return [
        Check(
            "figure15.two_over_four_axis_error",
            "two axes suppress errors more slowly than four",
            slow / quick_,
            "",
            within(slow / quick_, 1.1),
            f"medians from 1 to 3.5 s: {slow:.1f} over {quick_:.1f} px",
            "at least 1.1",
        ),
        Check(
            "figure15.two_axis_end_s",
            "after approximately five seconds a joint limit is exceeded",
            end,
            "s",
            two.outcome.kind is OutcomeKind.JOINT_LIMIT and within(end, 4.0, 6.0),
            "0.40 m at 0.1 m/s, the paper's own numbers, are 4 s",
            "4 to 6",
        ),
        Check(
            "figure15.late_over_early_error",
            "the steady-state error continues to decrease with the object's distance",
            late / early,
            "",
            within(late / early, 0.0, 0.9),
            f"medians from 20 to 25 s and from 3 to 8 s: {late:.1f} over {early:.1f} px",
            "at most 0.9",
        ),
    ]


def _middle_error(trial: Trial, start: float, end: float) -> float:
    time = trial.camera.time
    return float(np.median(trial.error_px[(time >= start) & (time <= end)]))
