"""A serial bus of Feetech's STS servos."""

import termios
from time import monotonic, sleep
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import IntArray
from vergence.errors import DriverSilent

_TORQUE, _STATE, _STATE_LENGTH = 40, 56, 10
_SPEED_SIGN = 1 << 15  # of the speed register
_QUIET_S = 0.01  # after which no answer is on its way any more
_FIND_S = 1.0  # for a servo to answer at first
_GENTLE = 1500  # ticks/s at which other servos move: a gripper closes within a second
_ATTEMPTS = 3
_MODEL = 777  # of an STS3215


_GONE = (OSError, termios.error)  # what pyserial raises


class ServoStates(NamedTuple):
    """What all servos say at one instant."""

    ticks: IntArray  # (n,) 0 to 4095
    speed: IntArray  # (n,) ticks/s
    temperature: IntArray  # (n,) °C
    fault: IntArray  # (n,) bits of voltage, encoder, heat, current and load; 0 if all is well


class ServoBus:
    """Reads and writes all servos of a bus at once.

    Args:
        sdk: Feetech's package.
        port: serial port.
        baud: its rate.
        ids: of the servos that are read and written together.
        others: ids of servos that are sent somewhere now and then, such as a gripper's.

    Raises:
        DriverSilent: if the port cannot be opened, or a servo does not answer.
    """

    def __init__(
        self, sdk: Any, port: str, baud: int, ids: tuple[int, ...], others: tuple[int, ...] = ()
    ) -> None:
        self._ids, self._others, self._success, self._name = ids, others, sdk.COMM_SUCCESS, port
        self._late = False  # whether an answer may still be on its way
        self._port = sdk.PortHandler(port)
        self._port.baudrate = baud
        try:
            self._port.openPort()
        except OSError as error:
            raise DriverSilent(
                f"the port {port} cannot be opened ({error.strerror or error}): check its cable, "
                "its name, and that your user may use it (group dialout)"
            ) from error
        self._servos = sdk.sms_sts(self._port)
        self._states = sdk.GroupSyncRead(self._servos, _STATE, _STATE_LENGTH)
        for number in ids:
            self._states.addParam(number)
        self._find()

    def read(self) -> ServoStates | None:
        """Return the states of all servos; None if one of them did not answer."""
        try:
            self._drop_late_answers()
            if self._states.txRxPacket() != self._success or not self._states.last_result:
                self._late = True
                return None
        except _GONE as error:
            raise DriverSilent(f"the port {self._name} has disappeared: check its cable") from error
        get = self._states.getData
        ticks, speed, temperature, fault = (
            np.array([get(number, address, size) for number in self._ids], dtype=np.int64)
            for address, size in ((56, 2), (58, 2), (63, 1), (65, 1))
        )
        backwards = (speed & _SPEED_SIGN) > 0
        speed &= _SPEED_SIGN - 1
        return ServoStates(ticks, np.where(backwards, -speed, speed), temperature, fault)

    def write(self, ticks: IntArray) -> None:
        """Send every servo to a position, (n,) ticks."""
        for number, tick in zip(self._ids, ticks.tolist(), strict=True):
            self._servos.SyncWritePosEx(number, tick, 0, 0)
        try:
            self._servos.groupSyncWrite.txPacket()
        except _GONE as error:
            raise DriverSilent(f"the port {self._name} has disappeared: check its cable") from error
        finally:
            self._servos.groupSyncWrite.clearParam()

    def send_other(self, number: int, tick: int) -> None:
        """Send one of the other servos to a position.

        Raises:
            DriverSilent: if it does not answer.
        """
        try:
            for _ in range(_ATTEMPTS):  # an answer may get lost
                self._drop_late_answers()
                result, _ = self._servos.WritePosEx(number, tick, _GENTLE, 0)
                if result == self._success:
                    result, _ = self._servos.write1ByteTxRx(number, _TORQUE, 1)
                if result == self._success:
                    return
                self._late = True
        except _GONE as error:
            raise DriverSilent(f"the port {self._name} has disappeared: check its cable") from error
        raise DriverSilent(f"servo {number} does not answer on {self._name}: check its cable")

    def hold(self) -> None:
        """Let every servo hold its place."""
        for number in self._ids:
            self._servos.write1ByteTxRx(number, _TORQUE, 1)

    def close(self) -> None:
        """Let go of the port; the servos continue holding their place."""
        self._port.closePort()

    def _drop_late_answers(self) -> None:
        """Empty the buffer: an answer that came too late would be taken for the next one."""
        if self._late:
            sleep(_QUIET_S)
        self._late = False
        self._port.ser.reset_input_buffer()

    def _find(self) -> None:
        for number in (*self._ids, *self._others):
            model, result, _ = self._ping(number)
            if result != self._success:
                self._port.closePort()
                raise DriverSilent(
                    f"servo {number} does not answer on {self._name}: check its power, the cable "
                    "from the servo before it, and its id"
                )
            if model != _MODEL:
                self._port.closePort()
                raise DriverSilent(f"servo {number} is of model {model}, not an STS3215 ({_MODEL})")

    def _ping(self, number: int) -> tuple[int, int, int]:
        """Ask a servo for its model, again if its answer is lost."""
        deadline = monotonic() + _FIND_S
        while True:
            model, result, error = self._servos.ping(number)
            if result == self._success or monotonic() > deadline:
                return model, result, error
            self._late = True
            self._drop_late_answers()
