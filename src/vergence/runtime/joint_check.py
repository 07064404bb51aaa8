"""Checks whether measured joints are complete, finite, recent and plausible."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.robot import Arm
from vergence.runtime.endings import Fault, bad_sample
from vergence.runtime.image_check import EARLY_S
from vergence.signals import JointState, Sample

_STALE_S = 0.1  # largest age of joints
_RATE_MARGIN = 3.0  # largest speed of a joint relative to its rate limit
_NOISE = 0.01  # rad or m that a joint may jump: resolution, vibration


@njit(cache=True, error_model="numpy")
def first_implausible(
    position: FloatArray, velocity: FloatArray, memory: FloatArray, elapsed: float
) -> int:
    """Return i if joint i is not finite, n + i if it moved too far since the last sample.

    Otherwise -1, or -2 if there are not n positions and velocities.

    Args:
        position: measured, (n,).
        velocity: measured, (n,).
        memory: the positions of the last sample, NaN before the first, and the largest plausible
            speed of each joint, (2, n); the positions are overwritten if there is no fault.
        elapsed: time since the last sample, s.
    """
    n = len(memory[0])
    if len(position) != n or len(velocity) != n:
        return -2
    for i in range(n):
        if not (np.isfinite(position[i]) and np.isfinite(velocity[i])):
            return i
        if abs(position[i] - memory[0, i]) > memory[1, i] * elapsed + _NOISE:
            return n + i
    for i in range(n):  # a slice assigned would compile its error message: two seconds
        memory[0, i] = position[i]
    return -1


class JointCheck:
    """Checks what every sample contains about one arm.

    Args:
        name: of the arm.
        arm: with its rate limits.
    """

    def __init__(self, name: str, arm: Arm) -> None:
        self._name, self._names, self._count = name, arm.names, arm.joint_count
        self._memory = np.vstack((np.full(arm.joint_count, np.nan), _RATE_MARGIN * arm.rate_max))

    def check(self, sample: Sample, elapsed: float) -> Fault | None:
        """Return the fault in the arm's joints in a sample, if any.

        Args:
            sample: with the driver's time.
            elapsed: since the sample before, s.
        """
        state = sample.joints.get(self._name)
        if not isinstance(state, JointState):
            return self._lacks("no state")
        if not -EARLY_S <= sample.time - state.time <= _STALE_S:
            return bad_sample(f"joints of {self._name} are {sample.time - state.time:.3f} s old")
        joint = first_implausible(state.position, state.velocity, self._memory, elapsed)
        if joint != -1:
            return self._implausible(joint, state, elapsed)
        return self._check_robot(sample) if sample.robots else None

    def _lacks(self, given: str) -> Fault:
        return bad_sample(f"{given} of {self._name}, which has {self._count} joints")

    def _implausible(self, joint: int, state: JointState, elapsed: float) -> Fault:
        if joint < 0:
            short = len(state.position) == self._count
            what, values = (
                ("velocities", state.velocity) if short else ("positions", state.position)
            )
            return self._lacks(f"{len(values)} joint {what}")
        moved, joint = divmod(joint, self._count)
        where = f"{self._names[joint]} of {self._name}"
        if not moved:
            return bad_sample(f"{where} is not finite")
        before, now = float(self._memory[0, joint]), float(state.position[joint])
        return bad_sample(f"{where} went from {before:.4g} to {now:.4g} in {elapsed:.3g} s")

    def _check_robot(self, sample: Sample) -> Fault | None:
        state = sample.robots.get(self._name)
        if state is None or 0.0 <= state.speed_scale <= 1.0:
            return None
        scale = state.speed_scale
        return bad_sample(f"the speed scale of {self._name} is {scale}, outside 0 to 1")
