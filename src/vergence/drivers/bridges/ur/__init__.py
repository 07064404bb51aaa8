"""A program for the Python that has ur_rtde: it joins a UR controller to the driver `ur`.

It needs nothing but ur_rtde. To the driver it is a robot of the project's socket protocol, see
`vergence.drivers.socket_robot.messages`.
"""
