"""The constrained servo: any objective, served as well as what is to be kept allows."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.camera import Camera
from vergence.control.constrained_rates import Avoidance, ConstrainedRates, constrained_rates
from vergence.control.constraints import KIND_NAMES, SOFT, ConstraintSettings
from vergence.control.objective import TwistObjective
from vergence.control.sight_lines import NO_SOLIDS
from vergence.errors import InputError, nearest
from vergence.robot import Arm
from vergence.signals import JointCommand


class ConstrainedSolver:
    """Turns an objective in the camera's twist into joint rates, within constraints.

    Joint positions, rates and accelerations never bend. The other constraints bend, when they
    contradict each other, in the reverse of the order given: the last first.

    Args:
        arm: up to the camera.
        camera: its intrinsics.
        period: how long a command acts, s.
        order: which of `SOFT` are kept, most important first.
        view_margin_px: how far features stay from the border of the picture.
        joint_margin: soft margin to position limits, share of each joint's range.
        clearance_m: how far sight lines stay from what might come between.
        solids: gives what might, now, (K, 16), see `sight_lines`; without it there is nothing.
        manipulability_min: lowest √det(J Jᵀ).
        approach_rate: share of the room left to a border that may be used up in a second.
        depth_range: factors between which the true depth lies of the believed one.
        S: weight on 1/w', with the penalty taken joint by joint.
        avoidance_rate_max: the joint rates that S alone may cause, rad/s.
        damping: on the joint rates, so that there is one answer.

    Raises:
        InputError: if the numbers contradict each other.
    """

    def __init__(
        self,
        arm: Arm,
        camera: Camera,
        *,
        period: float = 1 / 30,
        order: Sequence[str] = SOFT,
        view_margin_px: float = 10.0,
        joint_margin: float = 0.03,
        clearance_m: float = 0.02,
        solids: Callable[[], FloatArray] | None = None,
        manipulability_min: float = 0.0,
        approach_rate: float = 2.0,
        depth_range: tuple[float, float] = (0.5, 2.0),
        S: float = 0.0,
        avoidance_rate_max: float = 0.5,
        damping: float = 1e-6,
    ) -> None:
        self.arm, self.camera, self.period = arm, camera, period
        half = 0.5 * (min(camera.width, camera.height) - 1)
        _require("view_margin_px", view_margin_px, 0 <= view_margin_px < half,
                 f"from 0 to less than half the picture, {half:g}")  # fmt: skip
        _require("joint_margin", joint_margin, 0 <= joint_margin < 0.5,
                 "from 0 to less than half of a joint's range, 0.5")  # fmt: skip
        _require("depth_range", depth_range, 0 < depth_range[0] <= 1 <= depth_range[1],
                 "a factor above 0 up to 1, and one from 1")  # fmt: skip
        _require("clearance_m", clearance_m, clearance_m >= 0, "0 or more")
        _require("S", S, S >= 0, "0 or more")
        # Faster, and one command would use up more room than there is.
        _require("approach_rate_hz", approach_rate, 0 < approach_rate * period <= 1,
                 f"above 0, up to one command's share, {1 / period:g}")  # fmt: skip
        x_min, x_max, y_min, y_max = camera.rectangle(view_margin_px + 0.5)
        low, high = np.array([x_min, y_min]), np.array([x_max, y_max])
        self.settings = ConstraintSettings(
            approach_rate,
            joint_margin if "joint margin" in order else 0.0,
            low if "view" in order else np.full(2, -np.inf),
            high if "view" in order else np.full(2, np.inf),
            *depth_range,
            manipulability_min if "singularity" in order else 0.0,
            clearance_m,
            _ranks(order),
        )
        self.limits = np.vstack((arm.q_min, arm.q_max, arm.rate_max, arm.acceleration_max))
        self.avoidance = Avoidance(S, avoidance_rate_max, 50.0, damping)
        self._solids = solids if "occlusion" in order else None
        self._rest = np.zeros(arm.joint_count)

    def solve(
        self,
        position: FloatArray,
        velocity: FloatArray,
        objective: TwistObjective,
        features: FloatArray,
        spare: FloatArray | None = None,
    ) -> ConstrainedRates:
        """Return joint rates for the next period.

        Args:
            position: of the joints, (n,).
            velocity: of the joints, (n,).
            objective: what the camera should do.
            features: what has to stay in view, of `pack_features`, (M, 7).
            spare: rates wanted of joints where the objective leaves a choice, (n,); rest if None.
        """
        answer: ConstrainedRates = constrained_rates(
            self.arm.chain,
            self.limits,
            position,
            velocity,
            objective.H,
            objective.g,
            self._rest if spare is None else spare,
            features,
            NO_SOLIDS if self._solids is None else self._solids(),
            self.period,
            self.settings,
            self.avoidance,
        )
        return answer


class Pressure(NamedTuple):
    """Which constraints shaped a command, as `JointCommand` has it."""

    active: tuple[str, ...]  # those that pushed
    given_up: dict[str, float]  # those that bent: by how much, in the unit of their rows


def describe(active: FloatArray, given_up: FloatArray, solved: bool) -> Pressure:
    """Name what pushed and what was given up, by kind of constraint as in `ConstrainedRates`."""
    if not solved:
        return Pressure(("no solution: braking",), {})
    pushed = tuple(name for name, count in zip(KIND_NAMES, active, strict=True) if count)
    bent = {
        name: float(amount) for name, amount in zip(KIND_NAMES, given_up, strict=True) if amount > 0
    }
    return Pressure(pushed, bent)


def command_of(answer: ConstrainedRates) -> JointCommand:
    """Return an answer as a law gives it."""
    said = describe(answer.active, answer.given_up, answer.solved)
    return JointCommand(
        answer.rates,
        answer.v_camera,
        answer.manipulability,
        answer.penalty,
        said.active,
        given_up=said.given_up,
    )


def _require(key: str, given: object, fits: bool, allowed: str) -> None:
    if not fits:
        raise InputError("law", key, given, allowed)


def _ranks(order: Sequence[str]) -> IntArray:
    for name in order:
        if name not in SOFT:
            raise InputError("law", "order", name, nearest(name, SOFT))
    _require("order", list(order), len(set(order)) == len(order), "each constraint once")
    ranks = np.zeros(len(KIND_NAMES), dtype=np.int64)
    for place, name in enumerate(order, start=1):
        ranks[KIND_NAMES.index(name)] = place
    return ranks
