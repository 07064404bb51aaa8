"""The driver of an arm behind a bridge."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from vergence.drivers.bridge_process import BridgeProcess
from vergence.drivers.equipment import Equipment
from vergence.drivers.socket_robot import LinkBrokenError, SocketDriver
from vergence.errors import DriverSilent
from vergence.signals import Setpoint

_LATER_S = 0.5  # than the bridge, which tells more of what is missing
_CATCH_UP_S = 0.05  # of missed time is made up for by rates in quick succession; positions would
# move the arm faster than its limits

_OLD = 2.0  # periods that joints may be old when the loop gets them


class BridgeDriver(SocketDriver):
    """Speaks to a bridge, at the rate at which the robot reports its joints.

    Where the robot is told rates, these also pull the joints to the set-points, since rates alone
    drift away from them.

    Args:
        bridge: to the robot; it knows the rate.
        peer: what the bridge is, for messages.
        equipment: of the cell.
        arm: name of the arm.
        timeout_s: for which the bridge waits for the robot.
        gain: 1/s, with which rates pull the joints; None if the robot is told positions.
    """

    def __init__(
        self,
        bridge: BridgeProcess,
        peer: str,
        equipment: Equipment,
        arm: str,
        timeout_s: float,
        gain: float | None,
    ) -> None:
        self._bridge, self._arm, self._name, self._gain = bridge, equipment.arms[arm], arm, gain
        measured = replace(equipment, inner_rate_hz=float(bridge.found["rate_hz"]))
        super().__init__(bridge.link, measured, timeout_s + _LATER_S, peer, True)
        self._due = self._time

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Send set-points and wait for the robot's next joints."""
        setpoint = setpoints.get(self._name)
        self._send(self._words(setpoint) if setpoint is not None else self._answer({}))
        period, behind = 1.0 / self.inner_rate_hz, self._time - self._due
        missed = behind >= max(0.0 if self._gain is None else _CATCH_UP_S, period)
        self._due = period + (self._time if missed else self._due)
        early = self._due - 0.5 * period  # stamps need not be evenly spaced
        if self._time < early:
            self._receive()
        else:
            self._receive_what_came()
        # What was sent long ago, while the loop did something else, is old.
        old = self._now() - self._time > _OLD * period
        while self._time < early or old:
            self._send(self._answer({}))
            self._receive()
            old = False

    def close(self) -> None:
        """Let go; the bridge brakes an arm that still moves."""
        super().close()
        self._bridge.close()

    def _words(self, setpoint: Setpoint) -> dict[str, Any]:
        """Return what is sent to the bridge: positions and rates."""
        rates = setpoint.velocity
        if self._gain is not None:
            most, gap = self._arm.rate_max, setpoint.position - self._joints[self._name].position
            rates = np.minimum(np.maximum(rates + self._gain * gap, -most), most)
        return self._answer({self._name: [setpoint.position.tolist(), rates.tolist()]})

    def _silent(self, error: LinkBrokenError) -> DriverSilent:
        if error.refused:
            return DriverSilent(str(error).removeprefix("refuses: "))
        killed_by = self._bridge.killed_by()
        return DriverSilent(f"{self._peer} {f'was ended by {killed_by}' if killed_by else error}")
