"""Corrects images whose time stamps are late."""

from collections.abc import Mapping
from dataclasses import replace

from vergence.runtime.driver import Driver
from vergence.runtime.driver_wrapper import DriverWrapper
from vergence.runtime.hardware.joint_history import JointHistory
from vergence.signals import Sample


class LateStamps(DriverWrapper):
    """Forwards to a driver, and dates its images back to their exposure.

    Args:
        driver: of arms and cameras.
        latency_s: by camera name, delay of the images' stamps after exposure, s.
    """

    def __init__(self, driver: Driver, latency_s: Mapping[str, float]) -> None:
        super().__init__(driver)
        self._latency_s = latency_s
        self._history = {name: JointHistory(round(driver.inner_rate_hz)) for name in driver.arms}

    def read(self) -> Sample:
        """Return the joints now and the images that arrived, with their times of exposure."""
        sample = self.driver.read()
        for name, state in sample.joints.items():
            self._history[name].add(state)
        if not sample.frames:
            return sample
        frames = []
        for frame in sample.frames:
            time = frame.time - self._latency_s.get(frame.camera, 0.0)
            joints = {name: self._history[name].at(time) for name in frame.joints}
            frames.append(replace(frame, time=time, joints=joints))
        return replace(sample, frames=tuple(frames))
