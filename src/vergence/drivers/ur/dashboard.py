"""What a controller's dashboard says before anything is connected for real."""

import re
import socket

from vergence.errors import DriverSilent

_PORT, _TIMEOUT_S = 29999, 2.0
_GREETING = "universal robots dashboard"
_OLDEST = {3: 15, 5: 10}  # of PolyScope: the minor version by the major one


def check_ready(address: str) -> None:
    """Refuse a robot that would not take set-points, with what to do about it.

    Args:
        address: of the controller.

    Raises:
        DriverSilent: if no controller answers, it is switched off or stopped, or not in remote
            control.
    """
    try:
        with socket.create_connection((address, _PORT), _TIMEOUT_S) as connection:
            connection.settimeout(_TIMEOUT_S)
            _check(address, _Dashboard(connection))
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or "no answer"
        raise DriverSilent(
            f"no UR controller answers at {address}, port {_PORT} ({reason}): "
            "check its address, its cable and that it is switched on"
        ) from error


class _Dashboard:
    """Asks questions of one line and gets answers of one line."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection, self._lines = connection, connection.makefile("rb")
        self.greeting = self._answer()

    def ask(self, question: str) -> str:
        self._connection.sendall(question.encode() + b"\n")
        return self._answer()

    def _answer(self) -> str:
        line = self._lines.readline(1000)
        if not line:
            raise ConnectionError(0, "it closed the connection")
        return line.decode(errors="replace").strip()


def _check(address: str, dashboard: _Dashboard) -> None:
    if _GREETING not in dashboard.greeting.lower():
        raise DriverSilent(f"what answers at {address}, port {_PORT}, is no UR controller")
    _check_version(dashboard.ask("PolyscopeVersion"))
    mode = dashboard.ask("robotmode").rpartition(":")[2].strip()
    safety = dashboard.ask("safetystatus").rpartition(":")[2].strip()
    remote = dashboard.ask("is in remote control")
    if safety not in ("NORMAL", "REDUCED"):
        what = safety.replace("_", " ").lower()
        raise DriverSilent(f"the robot reports {what}: clear it on the teach pendant")
    if mode != "RUNNING":
        what = mode.replace("_", " ").lower()
        raise DriverSilent(
            f"the robot is in mode {what}, not running: switch it on and release its brakes"
        )
    if remote.lower() == "false":  # the CB series has no such mode, and does not know the question
        raise DriverSilent(
            "the robot is not in remote control: choose Remote Control at the top right of its "
            "teach pendant"
        )


def _check_version(answer: str) -> None:
    """Refuse a controller whose software is too old for ur_rtde."""
    found = re.search(r"(\d+)\.(\d+)", answer)
    if found is None:
        return
    major, minor = map(int, found.groups())
    if minor < _OLDEST.get(major, 0):
        raise DriverSilent(
            f"the controller runs PolyScope {major}.{minor}, and ur_rtde needs "
            f"{major}.{_OLDEST[major]} or newer: update it"
        )
