"""Pulls the joints towards a posture, as far as the other objectives leave them free."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.objectives.gain import Gain, gain_at
from vergence.control.objectives.objective import CameraState, JointQuadratic
from vergence.errors import InputError
from vergence.parts import knob, part


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
        n = state.arm.joint_count
        error = state.q - self._desired(state)
        rates = -gain_at(self.gain, error) * error
        return JointQuadratic(self.strength * np.eye(n), self.strength * rates)

    def _desired(self, state: CameraState) -> FloatArray:
        arm = state.arm
        assert arm is not None
        assert state.q is not None
        if self.position is None:
            limited = np.isfinite(arm.q_max - arm.q_min)
            low, high = np.where(limited, arm.q_min, 0.0), np.where(limited, arm.q_max, 0.0)
            middle: FloatArray = np.where(limited, 0.5 * (low + high), state.q)
            return middle
        if len(self.position) != arm.joint_count:
            given = f"{len(self.position)} values"
            raise InputError("Posture", "position", given, f"{arm.joint_count}, one per joint")
        return np.array(self.position)
