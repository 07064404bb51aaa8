"""Your own robot behind the driver protocol: vergence run CELL --driver my_robot:MyRobot

Here a simulated cell takes the place of the controller and the cameras; replace it by your own
calls.
"""

import vergence as vg


class MyRobot(vg.Driver):
    """Set-points go to the arm's controller at `inner_rate_hz`; joints and images come back."""

    arms, cameras, inner_rate_hz = {}, {}, 500.0  # by name: arms with limits, calibrated lenses

    def __init__(self, cell: vg.Cell, address: str) -> None:
        self._controller = vg.SimulatedDriver(cell)  # connect to `address`
        self.arms, self.cameras = self._controller.arms, self._controller.cameras
        self.inner_rate_hz = self._controller.inner_rate_hz  # how often it takes set-points

    def read(self) -> vg.Sample:
        """Return joints now, and the images that arrived since the last call."""
        return self._controller.read()

    def step(self, setpoints: dict[str, vg.Setpoint]) -> None:
        """Pass set-points on, and return at the next inner tick."""
        self._controller.step(setpoints)

    def close(self) -> None:
        """Release the robot."""
        self._controller.close()


if __name__ == "__main__":
    robot = MyRobot(vg.load_cell("puma560"), "192.0.2.1")
    print(robot.read().joints["puma"].position)
