"""A program for the Python that has rclpy: it joins ROS 2 topics to the driver `ros2` by a socket.

It needs nothing but rclpy and ROS's own messages. To the driver it is a robot of the project's
socket protocol, see `vergence.drivers.socket_robot.messages`.
"""
