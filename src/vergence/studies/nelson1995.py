"""[Nelson1995] section 5: tracking with and without avoidance, and the limits of the method."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vergence.assembly import run_cell
from vergence.cell import Cell, load_cell
from vergence.control import OptimalTracking
from vergence.signals import OutcomeKind
from vergence.studies import nelson1995_figures as figures
from vergence.studies.check import Check, Progress, StudyResult, bisect_threshold, within
from vergence.studies.rendered import with_imaging
from vergence.studies.trial import Trial, Trials

TITLE = "Nelson and Khosla (1995): singularity and joint limit avoidance while tracking"
RANGE_M = 2.5  # each way; 5 m in all
SPEED_M_S = 0.1
STRATEGIES: Mapping[str, Mapping[str, Any]] = {
    "two_axis": {"axes": ["x", "y"], "avoidance_axes": [], "S": 0.0},
    "four_axis": {"axes": ["x", "y", "rx", "ry"], "avoidance_axes": [], "S": 0.0},
    "avoidance": {},  # as the cell file has it: X and Y avoid, S = 0.001
}
WINDOW_PX = 32.0  # the search range of the tracker


def reproduce(
    out: Path, quick: bool, progress: Progress, seed: int = 0, imaging: str | None = None
) -> StudyResult:
    """Run section 5 and what follows from it; write the figures.

    Args:
        out: folder for the figures.
        quick: exact projections instead of rendered images.
        progress: told what is being done.
        seed: of the cell.
        imaging: of the camera, see `ImagingTable`.
    """
    cell = with_imaging(load_cell("puma560", seed=seed), imaging)
    trials = {}
    for i, (strategy, law) in enumerate(STRATEGIES.items()):
        for j, sign in enumerate((1, -1)):
            progress(
                f"{strategy.replace('_', ' ')}, {'+x' if sign > 0 else '-x'}", (2 * i + j) / 20
            )
            trials[strategy, sign] = run(moving(cell.replace(law=law), sign), quick)
    checks = [
        *_two_axis(trials),
        *_four_axis(trials),
        *_avoidance(trials, quick),
        _stability(cell, quick, progress),
        _headings(cell, quick, progress),
        _speed(cell, quick, progress),
    ]
    progress("figures", 0.97)
    drawn = figures.draw(out, cell, trials)
    return StudyResult(TITLE, tuple(checks), drawn, seed)


def moving(
    cell: Cell, sign: float, speed: float = SPEED_M_S, heading: float = 0.0, extra_s: float = 5.0
) -> Cell:
    """Return the cell with the object moving 2.5 m along a heading from the x axis, rad."""
    velocity = sign * speed * np.array([np.cos(heading), np.sin(heading), 0.0])
    return cell.replace(
        duration_s=RANGE_M / speed + extra_s,
        target={"motion": {"kind": "line", "velocity_m_s": velocity, "distance_m": RANGE_M}},
    )


def run(cell: Cell, quick: bool) -> Trial:
    """Run a cell."""
    return Trial(run_cell(cell, images=not quick))


def _two_axis(trials: Trials) -> list[Check]:
    plus, minus = trials["two_axis", 1], trials["two_axis", -1]
    stop_plus, stop_minus = plus.camera_m[-1], -minus.camera_m[-1]
    singular = plus.outcome.kind is OutcomeKind.SINGULARITY
    joint1 = minus.outcome.kind is OutcomeKind.JOINT_LIMIT and "joint1" in minus.outcome.reason
    return [
        Check(
            "two_axis.stop_plus_m",
            "0.53 ± 0.06, a singularity",
            stop_plus,
            "m",
            within(stop_plus, 0.47, 0.59) and singular,
            plus.outcome.reason,
        ),
        Check(
            "two_axis.stop_minus_m",
            "0.40 ± 0.05, joint 1",
            stop_minus,
            "m",
            within(stop_minus, 0.35, 0.45) and joint1,
            minus.outcome.reason,
        ),
        Check(
            "two_axis.range_m",
            "0.94 ± 0.1",
            stop_plus + stop_minus,
            "m",
            within(stop_plus + stop_minus, 0.84, 1.04),
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
            "about 2: between 1.6 and 2.8",
            four / two,
            "",
            within(four / two, 1.6, 2.8),
            ends,
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
            "5.0, both directions, never more than 32 px from where it should be",
            distance,
            "m",
            completed and distance > 2 * RANGE_M - 1e-6 and worst <= WINDOW_PX,
            f"largest error {worst:.1f} px",
        ),
        Check(
            "avoidance.min_manipulability_ratio",
            "stays high: at least 0.25 of the start",
            ratio,
            "",
            within(ratio, 0.25),
        ),
        Check(
            "avoidance.min_penalty", "never near zero: at least 0.2", penalty, "", penalty >= 0.2
        ),
        Check(
            "avoidance.final_error_px",
            "goes to zero when the object stops: at most 0.5",
            final,
            "px",
            within(final, 0.0, 0.5),
        ),
        Check(
            "avoidance.drift_max_px",
            "tracked against truly projected point, at most 1",
            drift,
            "px",
            within(drift, 0.0, 1.0),
            "exact projections: nothing to drift" if quick else "",
        ),
    ]


def _stability(cell: Cell, quick: bool, progress: Progress) -> Check:
    """Find the factor on Q at which a step of 20 px no longer dies out, four axes."""
    base = cell.replace(
        duration_s=8.0,
        law=dict(STRATEGIES["four_axis"]),
        target={"motion": {"kind": "step", "offset_m": [0.014, 0.0, 0.0], "time_s": 0.5}},
    )

    law = cell.law.objective
    assert isinstance(law, OptimalTracking)

    def stable(factor: float) -> bool:
        progress(f"stability at {factor:.2f} Q", 0.45)
        trial = run(base.replace(law={"Q": law.Q * factor}), quick)
        if not trial.outcome.succeeded:
            return False
        time, error = trial.camera.time, trial.error_px
        early = error[(time > 2.0) & (time < 4.0)].max()
        late = error[time > 6.0].max()
        return bool(late < max(0.7 * early, 1.0))

    factor = bisect_threshold(stable, 1.0, 10.0, 0.02)
    return Check(
        "stability.q_factor_unstable",
        "above 1.35 (2.7e-6 against 2.0e-6)",
        factor,
        "",
        within(factor, 1.35),
        f"at {cell.cameras[cell.task.camera].latency_frames} frames of latency, four axes, S = 0",
    )


def _headings(cell: Cell, quick: bool, progress: Progress) -> Check:
    failed = {}
    for heading in range(0, 360, 30):
        progress(f"heading {heading} degrees", 0.55 + 0.02 * heading / 30)
        trial = run(moving(cell, 1, heading=np.deg2rad(heading), extra_s=1.0), quick)
        if not _kept(trial):
            failed[heading] = str(trial.outcome)
    return Check(
        "headings.completed",
        "of 12 directions of 2.5 m; 0 and 180 degrees, which the paper ran, are among them",
        12 - len(failed),
        "",
        failed.keys().isdisjoint((0, 180)),
        "; ".join(f"{heading} degrees: {end}" for heading, end in failed.items()) or "all",
    )


def _speed(cell: Cell, quick: bool, progress: Progress) -> Check:
    def tracked(speed: float) -> bool:
        progress(f"{speed:.3f} m/s", 0.85)
        return all(
            _kept(run(moving(cell, sign, speed, extra_s=1.0), quick), error_px=None)
            for sign in (1, -1)
        )

    fastest = bisect_threshold(tracked, SPEED_M_S, 30 * SPEED_M_S, 0.03)
    return Check(
        "speed.max_m_s",
        "0.1 was run; how fast the object may be over 2.5 m each way",
        fastest,
        "m/s",
        within(fastest, SPEED_M_S),
    )


def _kept(trial: Trial, error_px: float | None = WINDOW_PX) -> bool:
    close = error_px is None or trial.summary["max_error_px"] <= error_px
    return trial.outcome.succeeded and close
