"""A driver whose cameras have delivered their first images, with the clock of the run."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.robot import Arm
from vergence.runtime.driver import Driver
from vergence.signals import Frame, Sample, Setpoint

_TIMEOUT_S = 5.0  # for a first image


class StartedDriver:
    """Passes on to a driver, after it has waited for an image of each camera without a set-point.

    What a task begins with is read off these images. The run begins with the first `read` after
    that, however long it took to assemble the loop; only what is exposed from then on is delivered.
    Samples keep the driver's time: the loop counts from its first one.

    Args:
        driver: of arms and cameras.
        cameras: names of those that are needed.

    Attributes:
        driver: the same.
        frames: the newest image of each camera that delivered one, by name, at times up to 0.
        missing: names of cameras that delivered none in time.

    Raises:
        DriverSilent: if the driver does not answer.
    """

    def __init__(self, driver: Driver, cameras: Sequence[str]) -> None:
        self.driver = driver
        first: dict[str, Frame] = {}
        sample = driver.read()
        for _ in range(int(_TIMEOUT_S * driver.inner_rate_hz)):
            first |= {frame.camera: frame for frame in sample.frames}
            if all(name in first for name in cameras):
                break
            driver.step({})  # a watchdog that has heard a set-point would not wait for the rest
            sample = driver.read()
        self.missing = tuple(name for name in cameras if name not in first)
        self._sample = sample  # the newest
        self.frames = {name: _since(sample.time, frame) for name, frame in first.items()}
        self._waited_until = sample.time
        self._begin: float | None = None

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
        """How often `step` returns."""
        return self.driver.inner_rate_hz

    @property
    def joints(self) -> dict[str, FloatArray]:
        """Newest positions by arm name, (n,), rad or m."""
        return {name: state.position for name, state in self._sample.joints.items()}

    def read(self) -> Sample:
        """Return joints now and the images that arrived since the last call."""
        sample = self._sample = self.driver.read()
        if self._begin is None:
            self._begin = sample.time
            if sample.time == self._waited_until:  # nothing moved: what was seen is of the run
                known = {(frame.camera, frame.time) for frame in sample.frames}
                unread = (_since(-sample.time, frame) for frame in self.frames.values())
                more = (f for f in unread if (f.camera, f.time) not in known)
                sample = replace(sample, frames=(*sample.frames, *more))
        if not sample.frames:
            return sample
        of_run = (frame for frame in sample.frames if not frame.time < self._begin)
        return replace(sample, frames=tuple(sorted(of_run, key=lambda frame: frame.time)))

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Hand set-points to the arms and wait for the next inner tick."""
        self.driver.step(setpoints)

    def close(self) -> None:
        """Let go of the cell."""
        self.driver.close()


def _since(begin: float, frame: Frame) -> Frame:
    return replace(frame, time=frame.time - begin) if begin else frame
