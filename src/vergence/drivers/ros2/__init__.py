"""Robots behind ROS 2: its arm controllers, joint states and images."""

from vergence.drivers.ros2.ros2 import Ros2

__all__ = ["Ros2"]
