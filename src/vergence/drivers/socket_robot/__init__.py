"""Any robot behind the project's own socket protocol."""

from vergence.drivers.socket_robot.link import Link, LinkBrokenError, connect
from vergence.drivers.socket_robot.messages import (
    Answer,
    Said,
    decode,
    encode,
    read_answer,
    read_image,
    read_said,
    said_by_robot,
    vector,
)
from vergence.drivers.socket_robot.socket_driver import SocketDriver
from vergence.drivers.socket_robot.socket_robot import SocketRobot

__all__ = [
    "Answer",
    "Link",
    "LinkBrokenError",
    "Said",
    "SocketDriver",
    "SocketRobot",
    "connect",
    "decode",
    "encode",
    "read_answer",
    "read_image",
    "read_said",
    "said_by_robot",
    "vector",
]
