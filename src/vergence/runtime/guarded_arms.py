"""The guarded set-points of all arms of a cell: one is moved, the others are held."""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import FloatArray
from vergence.control import ClearBraking
from vergence.robot import Clearance
from vergence.runtime.driver import Driver
from vergence.runtime.endings import Fault
from vergence.runtime.following import Follower, FollowingBound
from vergence.runtime.stopping import brake
from vergence.signals import OutcomeKind, Sample, Setpoint

_OUTSIDE = 0.5  # rad or m beyond its range from which a joint is still brought back


class GuardedArms:
    """Begins with the first sample at the measured joints.

    Args:
        driver: of the cell.
        moved: name of the arm that is moved.
        bound: largest allowed distance of an arm from its set-points.
        clearance: distances between bodies that must not collide; None for no check.
    """

    def __init__(
        self, driver: Driver, moved: str, bound: FollowingBound, clearance: Clearance | None
    ) -> None:
        self._driver, self._name = driver, moved
        self._bound, self._clearance = bound, clearance
        self._followers: dict[str, Follower] = {}
        self._rest = {name: np.zeros(arm.joint_count) for name, arm in driver.arms.items()}
        self._stuck = np.ones(driver.arms[moved].joint_count, dtype=np.bool_)

    @property
    def begun(self) -> bool:
        """Whether there are set-points."""
        return bool(self._followers)

    @property
    def moved(self) -> Follower:
        """The arm that is moved."""
        return self._followers[self._name]

    @property
    def moving(self) -> bool:
        """Whether any arm is commanded to move."""
        return any(follower.guard.moving for follower in self._followers.values())

    @property
    def setpoints(self) -> dict[str, Setpoint]:
        """The last set-point of each arm."""
        return {name: follower.guard.setpoint for name, follower in self._followers.items()}

    def begin(self, sample: Sample, timeout_s: float) -> Fault | None:
        """Start set-points at the measured joints; reject a start far outside the limits.

        Args:
            sample: the first one.
            timeout_s: longest time for which an arm is held.
        """
        dt = 1.0 / self._driver.inner_rate_hz
        for name, arm in self._driver.arms.items():
            start = sample.joints[name].position
            outside = np.maximum(arm.q_min - start, start - arm.q_max)
            if (worst := float(outside.max())) > _OUTSIDE:
                joint = f"{arm.names[int(outside.argmax())]} of {name}"
                reason = f"{joint} starts {worst:.3g} outside its range"
                return Fault(OutcomeKind.JOINT_LIMIT, reason)
            braking = None
            if self._clearance is not None and name == self._name:
                braking = ClearBraking(arm, self._clearance, dt)
            self._followers[name] = Follower(arm, name, start, dt, self._bound, timeout_s, braking)
        return None

    def observe(self, time: float, sample: Sample) -> Fault | None:
        """Process a sample; return the fault that ends the run if an arm was held for too long."""
        for name, follower in self._followers.items():
            robot = sample.robots.get(name)
            if name == self._name or robot is not None:
                measured = sample.joints[name].position
                if fault := follower.observe(time, measured, robot):
                    return fault
        return None

    def step(self, rates: FloatArray) -> dict[str, Setpoint]:
        """Return the next set-points, at desired rates (n,) of the arm that is moved."""
        setpoints = {
            name: follower.step(rates if name == self._name else self._rest[name])
            for name, follower in self._followers.items()
        }
        self._stuck &= self.moved.guard.at_limit
        return setpoints

    def steps(self, rates: FloatArray, count: int) -> dict[str, Setpoint] | None:
        """Return the set-point after several steps, see `Follower.steps`; only of one arm alone."""
        setpoint = self.moved.steps(rates, count)
        if setpoint is None:
            return None
        self._stuck &= self.moved.guard.at_limit
        return {self._name: setpoint}

    def stuck(self) -> Sequence[str]:
        """Return the joints that a limit has held back since this was last asked."""
        stuck, self._stuck[:] = self._stuck.copy(), True
        names = self._driver.arms[self._name].names
        return [name for name, held in zip(names, stuck, strict=True) if held]

    def brake(self) -> str:
        """Bring every arm to rest; return why that failed, empty if it did not."""
        return brake(self._driver, {name: f.guard for name, f in self._followers.items()})
