"""The limits of a law that follows a plan."""

from dataclasses import replace

from vergence.control import Limits

PLAN_MARGIN_PX, PLAN_MARGIN_JOINT = 10.0, 0.01  # of a plan whose task states none
_SHARE = 0.5  # of a plan's margins that is kept: it was made to be followed to within them
_RATE_HZ = 8.0  # a plan keeps clear of borders by itself: near them it is not to be slowed


def limits_on_plan(
    limits: Limits, margin_px: float, margin_joint: float, period_s: float
) -> Limits:
    """Return limits whose values that nobody stated suit a plan.

    Args:
        limits: as they are stated.
        margin_px: of the plan, to the border of the image.
        margin_joint: of the plan, to position limits; a share of half a joint's range.
        period_s: how long a command acts.
    """
    view_px, joint = limits.view_margin_px, limits.joint_margin
    rate = limits.approach_rate_hz
    return replace(
        limits,
        view_margin_px=_SHARE * margin_px if view_px is None else view_px,
        joint_margin=_SHARE * margin_joint / 2.0 if joint is None else joint,
        approach_rate_hz=min(_RATE_HZ, 1.0 / period_s) if rate is None else rate,
    )
