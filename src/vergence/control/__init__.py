"""Control: the laws, and how a camera twist becomes joint rates."""

from vergence.control.command import JointCommand

__all__ = ["JointCommand"]
