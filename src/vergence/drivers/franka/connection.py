"""Connecting to a robot of Franka."""

from collections.abc import Callable
from pathlib import Path
from threading import Thread
from typing import Any

from vergence.errors import DriverSilent

_REALTIME = Path("/sys/kernel/realtime")
_OTHER, _USER_STOPPED = "Other", "UserStopped"


def connect(franky: Any, address: str, realtime: bool, timeout_s: float) -> Any:
    """Return franky's robot, ready to move.

    A stop by reflex, such as a collision before, is cleared: the robot has no pendant to do so.

    Args:
        franky: the package.
        address: of the robot.
        realtime: whether a kernel that is not real-time is refused.
        timeout_s: for the robot to answer.

    Raises:
        DriverSilent: if no robot answers, it is of another version, or it would not move, with what
            to do about it.
    """
    if realtime and not (_REALTIME.is_file() and _REALTIME.read_text().strip() == "1"):
        raise DriverSilent(
            "this computer has no real-time kernel, which libfranka needs: install one, or set "
            "driver.realtime to false for a try at low speed"
        )
    kind = franky.RealtimeConfig.Enforce if realtime else franky.RealtimeConfig.Ignore
    robot = _opened(
        franky,
        address,
        lambda: franky.Robot(address, realtime_config=kind),
        "Franka robot",
        timeout_s,
    )
    mode = robot.state.robot_mode.name
    if mode == _USER_STOPPED:
        raise DriverSilent("the robot reports user stop: release its stop button")
    if mode == _OTHER:
        raise DriverSilent("the robot's joints are locked: unlock them in Desk")
    if robot.has_errors and not robot.recover_from_errors():
        raise DriverSilent("the robot reports an error that it cannot clear: look at Desk")
    return robot


def connect_hand(franky: Any, address: str, timeout_s: float) -> Any:
    """Return franky's gripper.

    Raises:
        DriverSilent: if the robot has none that answers.
    """
    return _opened(
        franky, address, lambda: franky.Gripper(address), "hand of a Franka robot", timeout_s
    )


def _opened(franky: Any, address: str, make: Callable[[], Any], what: str, timeout_s: float) -> Any:
    """Connect in a thread, since nothing else ends the wait for an address without a robot."""
    opened: list[Any] = []
    failed: list[Exception] = []

    def open_robot() -> None:
        try:
            opened.append(make())
        except Exception as error:
            failed.append(error)

    thread = Thread(target=open_robot, daemon=True)
    thread.start()
    thread.join(timeout_s)
    if failed:
        raise DriverSilent(_explained(franky, failed[0], address, what)) from failed[0]
    if not opened:
        raise DriverSilent(
            f"no {what} answers at {address} within {timeout_s:g} s: check its address and "
            "cable, and that no other client is connected"
        )
    return opened[0]


def _explained(franky: Any, error: Exception, address: str, what: str) -> str:
    """Return what an error of libfranka means for its user."""
    text = str(error).removeprefix("libfranka: ").strip()
    if isinstance(error, franky.IncompatibleVersionException):
        return (
            f"the robot at {address} speaks another version ({text}): install the franky-control "
            "of the robot's system version"
        )
    if isinstance(error, franky.NetworkException):
        return (
            f"no {what} with an active FCI answers at {address} ({text}): check its address "
            "and cable, and activate FCI in Desk"
        )
    return f"the robot at {address} does not take the connection: {text}"
