"""When a law that inverts the Jacobian has to give up."""

from vergence.signals import OutcomeKind


def singular_fault(sigma: float, singular_below: float) -> tuple[OutcomeKind, str] | None:
    """Return the fault of an arm too near a singularity, if it is.

    Args:
        sigma: smallest singular value of its Jacobian.
        singular_below: below which a law gives up.
    """
    if not sigma < singular_below:
        return None
    reason = (
        f"the smallest singular value of the Jacobian fell to {sigma:.3g} "
        f"(limit {singular_below:g})"
    )
    return OutcomeKind.SINGULARITY, reason
