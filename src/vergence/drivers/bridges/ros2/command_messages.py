"""The messages that arm controllers of ROS 2 take."""

from collections.abc import Callable
from typing import Any

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import TwistStamped
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from .command import Command


class CommandMessages:
    """Makes messages of set-points.

    Args:
        settings: of the driver: joints, rate, acceleration limits, the frame of the twist.
        now: the stamp of a message, of the node's clock.
    """

    def __init__(self, settings: dict[str, Any], now: Callable[[], Any]) -> None:
        self._settings, self._now = settings, now
        self.type, self.of = {
            "velocity": (Float64MultiArray, self._velocity),
            "position": (Float64MultiArray, self._position),
            "trajectory": (JointTrajectory, self._trajectory),
            "twist": (TwistStamped, self._twist),
        }[settings["command"]]

    def _velocity(self, command: Command) -> Any:
        """Return what `forward_velocity_controller` takes."""
        return Float64MultiArray(data=command.velocity)

    def _position(self, command: Command) -> Any:
        """Return what `forward_position_controller` takes."""
        return Float64MultiArray(data=command.position)

    def _trajectory(self, command: Command) -> Any:
        """Return what `joint_trajectory_controller` takes: on for a moment, then to rest.

        It ends at rest, as that controller demands, so the arm brakes if no other follows.
        """
        ahead_s = self._settings["trajectory_ahead_s"]
        to_rest_s = command.seconds_to_rest(self._settings["acceleration_max"])
        pairs = zip(command.position, command.velocity, strict=True)
        there = command._replace(position=[q + ahead_s * v for q, v in pairs])
        points = [(there, ahead_s)]
        if to_rest_s > 0.0:
            points.append((there.braked(to_rest_s, to_rest_s), ahead_s + to_rest_s))
        return JointTrajectory(
            joint_names=self._settings["joints"],
            points=[
                JointTrajectoryPoint(
                    positions=point.position,
                    velocities=point.velocity,
                    time_from_start=_duration(seconds),
                )
                for point, seconds in points
            ],
        )

    def _twist(self, command: Command) -> Any:
        """Return what MoveIt Servo takes."""
        message = TwistStamped()
        message.header.stamp = self._now()
        message.header.frame_id = self._settings["twist_frame"]
        linear, angular = message.twist.linear, message.twist.angular
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = command.twist
        return message


def _duration(seconds: float) -> Any:
    whole = int(seconds)
    return Duration(sec=whole, nanosec=int(1e9 * (seconds - whole)))
