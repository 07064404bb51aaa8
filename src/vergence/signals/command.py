"""What a law asks of an arm."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from vergence.arrays import FloatArray
from vergence.signals.outcome import OutcomeKind
from vergence.signals.reference import Reference


@dataclass(frozen=True, slots=True)
class JointCommand:
    """Joint rates for the next outer period, and how the law came to them."""

    velocity: FloatArray  # (n,) rad/s or m/s
    # (6,) the camera twist these rates were made from, m/s and rad/s; of a fixed camera that looks
    # at what the arm holds, its twist as seen from there.
    v_camera: FloatArray
    manipulability: float = float("nan")  # w'(q) of [Nelson1995] eq. (26), SI units
    penalty: float = float("nan")  # P(q) of [Nelson1995] eq. (27)
    active: tuple[str, ...] = field(default=())  # constraints that shaped the command
    fault: tuple[OutcomeKind, str] | None = None  # why the law cannot continue
    slack: Mapping[str, float] = field(default_factory=dict)  # relaxed limits, and by how much
    # m, the arm's least distance to what is near: "self", "arms", "fixtures", "target".
    clearance: Mapping[str, float] = field(default_factory=dict)
    # s - s_star of each value of the features, by a name such as "size" or "centre.0"; empty of
    # image points.
    errors: Mapping[str, float] = field(default_factory=dict)
    # The reference with the nearest points at which these errors are 0, where the features leave
    # points free; None where the reference itself is the goal.
    reference: Reference | None = None
