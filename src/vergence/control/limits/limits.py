"""The limits of a servo: margins, and which of them are relaxed first when they conflict."""

from typing import Annotated, Literal, Protocol, runtime_checkable

from pydantic import Field

from vergence.arrays import FloatArray
from vergence.control.limits._rows import KIND_NAMES, RELAXED
from vergence.errors import InputError
from vergence.parts import knob, part, slot
from vergence.robot import Arm

Relaxed = Literal["collision", "view", "occlusion", "singularity", "joint margin"]
_Share = Annotated[float, Field(gt=0, le=1)]
_Factor = Annotated[float, Field(ge=1, le=1e3)]


@runtime_checkable
class Limit(Protocol):
    """A user's own limit, as rows C q̇ ≥ d."""

    def rows(
        self, arm: Arm, q: FloatArray, velocity: FloatArray, period_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return C (m, n) and d (m,) for this tick.

        Args:
            arm: up to its tip.
            q: joint positions, (n,).
            velocity: joint rates now, (n,).
            period_s: time for which the command acts, s.
        """
        ...


@part("limits", "limits")
class Limits:
    """Limits of the quadratic program. Joint positions, rates and accelerations are hard.

    The others are relaxed when they conflict, the last of `order` first, but after a user's own;
    the slack is reported. A limit that is not in `order` is not enforced.
    """

    order: tuple[Relaxed, ...] = knob(RELAXED)  # highest priority first
    # Distance kept from the image border; default 10, or half of that of a plan.
    view_margin_px: float | None = knob(None, "px", least=0, upto=1e4)
    # Fraction of each joint's range to keep free; default 0.01, or half of that of a plan.
    joint_margin: float | None = knob(None, least=0, below=0.5)
    # Smallest angle between the line of sight and a face that shows features; part of "view".
    facing_deg: float = knob(1.0, "degrees", least=0, below=90)
    # Distance between lines of sight and obstacles.
    clearance_m: float = knob(0.02, "m", least=0, upto=10)
    # Fraction of √det(J Jᵀ) at the start to keep; yields if it alone stops the arm.
    manipulability_share: float = knob(0.0, least=0, below=1)
    # Rate of approach to a limit, relative to the distance left; default 2, or 8 on a plan.
    approach_rate_hz: float | None = knob(None, "1/s", above=0, upto=1e3)
    # Bounds on the ratio of true to assumed depth.
    depth_range: tuple[_Share, _Factor] | None = knob(None)
    # Your own limits, relaxed before all others.
    own: tuple[Limit, ...] = slot("limit", (), many=True)

    def __post_init__(self) -> None:
        if len(set(self.order)) != len(self.order):
            raise InputError(type(self).__name__, "order", list(self.order), "each limit once")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the kinds of limits, the user's own last."""
        return (*KIND_NAMES, *(type(limit).__name__ for limit in self.own))
