"""The driver of one arm with cameras of this computer."""

from collections.abc import Mapping
from time import monotonic, sleep

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.drivers.arm_link import ArmLink
from vergence.drivers.controller_clock import ControllerClock
from vergence.drivers.equipment import Equipment
from vergence.drivers.local_cameras import LocalCameras
from vergence.errors import DriverSilent
from vergence.robot import Arm
from vergence.runtime.driver import HasOutputs, outputs_of
from vergence.runtime.hardware import JointHistory
from vergence.signals import JointState, Sample, Setpoint

_POLL_S = 2e-4


class ArmDriver:
    """Moves an arm by its controller's clock: `step` returns when that clock reaches the next tick.

    Args:
        equipment: of the cell.
        arm: name of the arm that the link moves.
        link: to its controller.
        timeout_s: how long the controller's clock may not advance.

    Raises:
        DriverSilent: from `read` and `step`, if the controller does not answer.
    """

    def __init__(
        self, equipment: Equipment, arm: str, link: ArmLink, timeout_s: float = 0.5
    ) -> None:
        self.arms: Mapping[str, Arm] = {arm: equipment.arms[arm]}
        self.cameras: Mapping[str, Camera] = equipment.cameras
        self.inner_rate_hz = link.rate_hz
        self._name, self._link, self._timeout_s = arm, link, timeout_s
        self._history = JointHistory(round(2.0 * link.rate_hz))
        self._reading = link.read()
        self._clock = ControllerClock(self._reading.time)
        self._note()
        self._due = self._reading.time
        self._cameras = LocalCameras(equipment.sources, self._clock.now)

    def read(self) -> Sample:
        """Return joints now, and the images that arrived since the last call."""
        reading = self._reading
        frames = self._cameras.frames(self._joints_at, reading.time)
        joints = {self._name: JointState(reading.time, reading.position, reading.velocity)}
        return Sample(reading.time, joints, frames, {self._name: reading.robot})

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Hand the set-point to the arm, and wait for the controller's next tick."""
        if self._name in setpoints:
            self._link.send(setpoints[self._name])
        period, behind = 1.0 / self.inner_rate_hz, self._reading.time - self._due
        missed = behind >= max(self._link.catch_up_s, period)
        self._due = period + (self._reading.time if missed else self._due)
        self._wait()
        self._note()

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the link's outputs; none if it has none."""
        return outputs_of(self._link)

    def set_output(self, name: str, value: float) -> None:
        """Set an output of the link."""
        assert isinstance(self._link, HasOutputs), "only an output that there is can be set"
        self._link.set_output(name, value)

    def close(self) -> None:
        """Let go of arm and cameras."""
        self._cameras.close()
        self._link.close()

    def _wait(self) -> None:
        """Read until the controller's clock reaches the next tick."""
        deadline = monotonic() + self._timeout_s
        last = self._reading.time
        while True:
            self._reading = self._link.read()
            left = self._due - self._reading.time
            if left <= 1e-5:
                return
            now = monotonic()
            if self._reading.time != last:
                last, deadline = self._reading.time, now + self._timeout_s
            if now > deadline:
                raise DriverSilent(
                    f"the controller's clock has not advanced for {self._timeout_s:g} s"
                )
            sleep(min(max(left - _POLL_S, _POLL_S), 0.01))  # each reading costs more than sleep

    def _note(self) -> None:
        time, position, velocity, _ = self._reading
        self._clock.hear(time)
        self._history.add(JointState(time, position, velocity))

    def _joints_at(self, time: float) -> dict[str, FloatArray]:
        return {self._name: self._history.at(time)}
