"""Pulls the joints towards a posture, as far as the other objectives leave them free."""

from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from vergence.arrays import FloatArray
from vergence.control.objectives.gain import Gain, GainNumbers, falling_gain, gain_numbers
from vergence.control.objectives.objective import CameraState, JointQuadratic
from vergence.errors import InputError
from vergence.parts import knob, part
from vergence.robot import Arm


class PostureDecay(NamedTuple):
    """The numbers of the objective."""

    gain: GainNumbers
    position: FloatArray  # (n,) desired; NaN for a joint that it leaves where it is
    strength: float


@part("objective", "posture")
class Posture:
    """Pulls the joints towards a posture: q̇ = -λ (q - q_star), with a small weight.

    With the pseudo-inverse it acts in the null space of the other objectives.
    """

    supplements = True  # other objectives; alone it serves no task

    # Decay rate λ of the error; in a cell file it may also be { near, far, slope }.
    gain: Gain = knob(1.0, "1/s")
    # Desired joint positions, rad or m; the middle of each range if absent.
    position: tuple[float, ...] | None = knob(None)
    strength: float = knob(1e-4, above=0, upto=1e3)  # weight

    def quadratic(self, state: CameraState) -> JointQuadratic:
        """Return the quadratic for this tick."""
        assert state.arm is not None
        assert state.q is not None
        return posture_quadratic(self.numbers(state.arm), state.q)

    def numbers(self, arm: Arm) -> PostureDecay:
        """Return the objective's numbers for an arm, for kernels.

        Raises:
            InputError: if the posture has another number of joints.
        """
        return PostureDecay(gain_numbers(self.gain), self._desired(arm), self.strength)

    def _desired(self, arm: Arm) -> FloatArray:
        if self.position is None:
            limited = np.isfinite(arm.q_max - arm.q_min)
            low, high = np.where(limited, arm.q_min, 0.0), np.where(limited, arm.q_max, 0.0)
            middle: FloatArray = np.where(limited, 0.5 * (low + high), np.nan)
            return middle
        if len(self.position) != arm.joint_count:
            given = f"{len(self.position)} values"
            raise InputError("Posture", "position", given, f"{arm.joint_count}, one per joint")
        return np.array(self.position, dtype=np.float64)


@register_jitable
def posture_quadratic(decay: PostureDecay, q: FloatArray) -> JointQuadratic:
    """Return the quadratic of `Posture` for joint positions (n,)."""
    error = q - decay.position
    for i in range(len(q)):
        if np.isnan(decay.position[i]):
            error[i] = 0.0
    rates = -falling_gain(decay.gain, np.max(np.abs(error))) * error
    return JointQuadratic(decay.strength * np.eye(len(q)), decay.strength * rates)
