"""A driver that wraps another one."""

from collections.abc import Mapping

from vergence.camera import Camera
from vergence.robot import Arm
from vergence.runtime.driver import Driver, HasOutputs, has_sim_time, outputs_of
from vergence.signals import Sample, Setpoint


class DriverWrapper:
    """Forwards everything to another driver; base of classes that change something.

    Args:
        driver: the wrapped driver.
    """

    def __init__(self, driver: Driver) -> None:
        self.driver = driver

    @property
    def arms(self) -> Mapping[str, Arm]:
        """The arms by name."""
        return self.driver.arms

    @property
    def cameras(self) -> Mapping[str, Camera]:
        """The cameras by name."""
        return self.driver.cameras

    @property
    def inner_rate_hz(self) -> float:
        """The rate at which `step` returns, Hz."""
        return self.driver.inner_rate_hz

    @property
    def sim_time(self) -> bool:
        """Whether the driver's time advances in `step` only."""
        return has_sim_time(self.driver)

    def read(self) -> Sample:
        """Return the driver's sample."""
        return self.driver.read()

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Forward the set-points."""
        self.driver.step(setpoints)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs; none if the driver has none."""
        return outputs_of(self.driver)

    def set_output(self, name: str, value: float) -> None:
        """Set an output of the driver."""
        assert isinstance(self.driver, HasOutputs), "only existing outputs can be set"
        self.driver.set_output(name, value)

    def close(self) -> None:
        """Release the driver."""
        self.driver.close()
