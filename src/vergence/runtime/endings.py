"""The outcomes of a run with their reasons, for the loop and for the batch kernel."""

import re
from collections.abc import Iterable
from typing import NamedTuple

from vergence.signals import Outcome, OutcomeKind


class Fault(NamedTuple):
    """Why a run cannot continue."""

    kind: OutcomeKind
    reason: str  # one sentence for a person


def bad_sample(reason: str) -> Fault:
    """Return the fault of a sample."""
    return Fault(OutcomeKind.BAD_SAMPLE, reason)


def bad_command(reason: str) -> Fault:
    """Return the fault of a law's command."""
    return Fault(OutcomeKind.BAD_COMMAND, reason)


def clock_error(reason: str) -> Fault:
    """Return the fault of a clock."""
    return Fault(OutcomeKind.CLOCK_ERROR, reason)


def completed(duration_s: float, time: float) -> Outcome:
    """Return the outcome of a run that lasted its full time."""
    reason = f"ran for {round(duration_s, 3):g} s with the target in view"
    return Outcome(OutcomeKind.COMPLETED, reason, time)


def reached(error_px: float, time: float) -> Outcome:
    """Return the outcome of a run that reached its goal."""
    return Outcome(OutcomeKind.REACHED, f"{error_px:.2g} px from the goal", time)


def not_reached(error_px: float, why: str, time: float) -> Outcome:
    """Return the outcome of a run that ended away from its goal."""
    where = (
        "the features are not found" if error_px != error_px else f"{error_px:.3g} px from the goal"
    )
    return Outcome(OutcomeKind.NOT_REACHED, f"{where}: {why}", time)


def image_late(waited_s: float, time: float) -> Outcome:
    """Return the outcome of a run without images."""
    return Outcome(OutcomeKind.IMAGE_LATE, f"no image for {waited_s:.2f} s", time)


def target_lost(reasons: Iterable[str], time: float) -> Outcome:
    """Return the outcome of a run that lost its target, given perception's reasons."""
    return Outcome(OutcomeKind.TARGET_LOST, why_lost(reasons), time)


def why_lost(reasons: Iterable[str]) -> str:
    """Return the distinct loss reasons; those that differ only in numbers are merged."""
    kinds = {re.sub(r"-?\d[\d.]*", "", reason): reason for reason in reasons if reason}
    return "no feature found: " + "; ".join(sorted(kinds.values()))


def collision(hindrance: str, time: float) -> Outcome:
    """Return the outcome of a run stopped because its arm would have made bodies collide."""
    return Outcome(OutcomeKind.COLLISION, f"braked, as {hindrance} of each other", time)


def joint_limit(joints: Iterable[str], time: float) -> Outcome:
    """Return the outcome of a run with joints held at their limits."""
    reason = f"{' and '.join(joints)} at the end of its range, driven against it"
    return Outcome(OutcomeKind.JOINT_LIMIT, reason, time)
