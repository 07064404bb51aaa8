"""How far the method of [Nelson1995] goes: gains, directions, speeds, and its misprinted sign."""

from collections.abc import Callable

import numpy as np

from vergence.cell import Cell
from vergence.control import OptimalTracking
from vergence.signals import OutcomeKind
from vergence.studies.check import Check, Progress, bisect_threshold, within
from vergence.studies.nelson1995.runs import (
    SPEED_M_S,
    STRATEGIES,
    WINDOW_PX,
    kept,
    moving,
    run,
)
from vergence.studies.nelson1995.trial import Trial

Q_LIMIT, R_LIMIT = 1.35, 6.0  # where the paper's loop becomes unstable: 2.7e-6 / 2.0e-6; R from 10
SHORT_M = 0.3  # within reach of two axes, either way
LEAST_COMPLETED = 10  # of twelve directions


def misprint(cell: Cell, quick: bool) -> Check:
    """Track along x with the sign of (13) as printed."""
    printed = {"kind": f"{__package__}.misprint:PrintedTracking"}
    trial = run(moving(cell.replace(law={**printed, "solver": "pseudo_inverse"}), 1), quick)
    error = trial.error_px
    lost = float(trial.camera.time[-1])
    return Check(
        "misprint.sign_lost_s",
        "not in the paper: (13) as printed, two axes, loses the feature",
        lost,
        "s",
        trial.outcome.kind is OutcomeKind.TARGET_LOST and within(lost, 0.0, 2.0),
        f"{trial.outcome}; at most {np.nanmax(error):.0f} px off",
        "at most 2",
    )


def stability(cell: Cell, quick: bool, progress: Progress) -> list[Check]:
    """Find the factor on Q, and the R, at which a step of 20 px no longer dies out, four axes."""
    law = cell.law.objective
    assert isinstance(law, OptimalTracking)
    R = float(np.mean(law.R))
    base = cell.replace(
        duration_s=8.0,
        law=dict(STRATEGIES["four_axis"]),
        target={"motion": {"kind": "step", "offset_m": [0.014, 0.0, 0.0], "time_s": 0.5}},
    )

    def stable(changed: Cell) -> bool:
        trial = run(changed, quick)
        return trial.outcome.succeeded and _dies_out(trial)

    def with_Q(factor: float) -> bool:
        progress(f"stability at {factor:.2f} Q", 0.13)
        return stable(base.replace(law={"Q": law.Q * factor}))

    def with_R(factor: float) -> bool:
        progress(f"stability at R = {R / factor:.1f}", 0.21)
        return stable(base.replace(law={"R": R / factor}))

    factor = bisect_threshold(with_Q, 1.0, 10.0, 0.02)
    least = R / bisect_threshold(with_R, 1.0, 10.0, 0.02)
    latency = cell.cameras[cell.task.camera].latency_frames
    return [
        Check(
            "stability.q_factor_unstable",
            f"{Q_LIMIT:g} is the limit (Q = 2.7e-6 against 2.0e-6)",
            factor,
            "",
            within(factor, Q_LIMIT, R / R_LIMIT),
            f"at {latency} frames of latency, four axes, S = 0; then only Q/R counts, so that the "
            f"paper's two limits, on Q and on R, contradict each other",
            f"between the paper's limits on Q and on R: {Q_LIMIT:g} and {R / R_LIMIT:.2f}",
        ),
        Check(
            "stability.r_unstable",
            f"R below {R_LIMIT:g} is unstable",
            least,
            "",
            within(least, R_LIMIT, R / Q_LIMIT),
            "",
            f"between {R_LIMIT:g} and {R / Q_LIMIT:.2f}, where its limit on Q puts it",
        ),
    ]


def _dies_out(trial: Trial) -> bool:
    time, error = trial.camera.time, trial.error_px
    early = error[(time > 2.0) & (time < 4.0)].max()
    late = error[time > 6.0].max()
    return bool(late < max(0.7 * early, 1.0))


def headings(cell: Cell, quick: bool, progress: Progress) -> Check:
    """Move the object in twelve directions; see whether something hides it where it is lost."""
    failed, unexplained = {}, []
    for heading in range(0, 360, 30):
        progress(f"heading {heading} degrees", 0.28 + 0.3 * heading / 360)
        trial = run(moving(cell, 1, heading=np.deg2rad(heading), extra_s=1.0), quick)
        if not kept(trial):
            failed[heading] = str(trial.outcome)
            if trial.camera.visible[-1].all():
                unexplained.append(heading)
    completed = 12 - len(failed)
    ran = failed.keys().isdisjoint((0, 180))
    ends = "; ".join(f"{heading} degrees: {end}" for heading, end in failed.items()) or "all"
    in_view = f"; in view where lost: {unexplained}" if unexplained else ""
    return Check(
        "headings.completed",
        "fails where the manipulator's base hides the object or its depth is too great",
        completed,
        "",
        ran and not unexplained and completed >= LEAST_COMPLETED,
        f"{ends}{in_view}",
        f"at least {LEAST_COMPLETED} of 12 over 2.5 m, 0 and 180 degrees among them; the others "
        "hidden",
    )


def speed(cell: Cell, quick: bool, progress: Progress) -> list[Check]:
    """Find how fast the object may move: 2.5 m with avoidance, and by the axes that track."""

    def tracked(fast: float) -> bool:
        progress(f"{fast:.3f} m/s", 0.6)
        return all(
            kept(run(moving(cell, sign, fast, extra_s=1.0), quick), error_px=None)
            for sign in (1, -1)
        )

    def by(strategy: str) -> Callable[[float], bool]:
        changed = cell.replace(law=dict(STRATEGIES[strategy]))

        def held(fast: float) -> bool:
            progress(f"{strategy.replace('_', ' ')}, {fast:.3f} m/s", 0.7)
            runs = (moving(changed, sign, fast, 0.0, 0.5, SHORT_M) for sign in (1, -1))
            return all(kept(run(one, quick)) for one in runs)

        return held

    fastest = bisect_threshold(tracked, SPEED_M_S, 30 * SPEED_M_S, 0.03)
    if np.isnan(fastest):
        fastest = bisect_threshold(tracked, 0.2 * SPEED_M_S, SPEED_M_S, 0.03)
    two, four = (
        bisect_threshold(by(strategy), SPEED_M_S, 4 * SPEED_M_S, 0.03)
        for strategy in ("two_axis", "four_axis")
    )
    return [
        Check(
            "speed.max_m_s",
            "0.1 was run",
            fastest,
            "m/s",
            within(fastest, SPEED_M_S),
            "avoidance, 2.5 m each way; searched for from 0.02 to 3 m/s",
            f"at least {SPEED_M_S:g}",
        ),
        Check(
            "speed.four_over_two_axis",
            "two rotational axes allow for faster object motion",
            four / two,
            "",
            within(four / two, 1.03),
            f"{four:.3f} over {two:.3f} m/s over {SHORT_M:g} m each way, never more than "
            f"{WINDOW_PX:g} px off",
            "at least 1.03, as close as it is searched for",
        ),
    ]
