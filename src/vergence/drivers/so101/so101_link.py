"""The connection to an arm of Feetech servos."""

from time import monotonic
from typing import TYPE_CHECKING

import numpy as np

from vergence.arrays import FloatArray
from vergence.drivers.arm_link import ArmReading
from vergence.drivers.so101.servo_bus import ServoBus
from vergence.errors import DriverSilent
from vergence.signals import RobotMode, RobotState, Setpoint

if TYPE_CHECKING:
    from vergence.drivers.so101.so101 import So101

_TICK = 2 * np.pi / 4096  # rad


class So101Link:
    """Sends positions to the servos and reads them, at the rate of the bus.

    The servos have no clock: this computer's stamps their answers. If the client ends, they hold
    the last position they were told, which is never far from where they are.

    Args:
        bus: of the servos.
        settings: of the arm.
    """

    def __init__(self, bus: ServoBus, settings: "So101") -> None:
        self.rate_hz, self.catch_up_s = settings.rate_hz, 0.0
        self._bus, self._settings = bus, settings
        self._heard = monotonic()
        reading = self._ask()
        while reading is None:
            reading = self._ask()
        self._reading = reading
        self.send(Setpoint(reading.position, np.zeros(len(reading.position))))
        bus.hold()

    def read(self) -> ArmReading:
        """Return the newest reading; the bus is asked once a period."""
        if monotonic() - self._reading.time >= 0.9 / self.rate_hz:
            self._reading = self._ask() or self._reading
        return self._reading

    def send(self, setpoint: Setpoint) -> None:
        """Send the servos to a set-point."""
        ticks = self._zero + self._sign * setpoint.position / _TICK
        self._bus.write(np.clip(np.rint(ticks), 0, 4095).astype(np.int64))

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the servos beside the arm's joints."""
        return tuple(self._settings.outputs)

    def set_output(self, name: str, value: float) -> None:
        """Send a servo to a position between its ticks at 0 and those at 1."""
        number, at_zero, at_one = self._settings.outputs[name]
        self._bus.send_other(number, round(at_zero + value * (at_one - at_zero)))

    def close(self) -> None:
        """Let go of the bus; the servos hold their place, or the arm would fall."""
        self._bus.close()

    def _ask(self) -> ArmReading | None:
        """Return a fresh reading; None if an answer got lost, which happens on such a bus."""
        asked = monotonic()
        states = self._bus.read()
        if states is None:
            if asked - self._heard > self._settings.timeout_s:
                raise DriverSilent(
                    f"no answer from the servos for {self._settings.timeout_s:g} s: check their "
                    "power and cables"
                )
            return None
        self._heard = monotonic()
        position = self._sign * (states.ticks - self._zero) * _TICK
        velocity = self._sign * states.speed * _TICK
        well = not states.fault.any() and states.temperature.max() <= self._settings.hottest_deg_c
        mode = RobotMode.RUNNING if well else RobotMode.PROTECTIVE_STOP
        return ArmReading(0.5 * (asked + self._heard), position, velocity, RobotState(mode))

    @property
    def _zero(self) -> FloatArray:
        return np.array(self._settings.zero_ticks or 2048, dtype=np.float64)

    @property
    def _sign(self) -> FloatArray:
        return np.array(self._settings.signs or 1, dtype=np.float64)
