"""A driver that misbehaves from some moment on."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from vergence.runtime import Driver, DriverWrapper
from vergence.signals import Frame, OutcomeKind, Sample, Setpoint

Setpoints: TypeAlias = Mapping[str, Setpoint]


class DriverFault(NamedTuple):
    """One way in which a driver may misbehave."""

    ends: frozenset[OutcomeKind]  # how a run with it may end
    spoil: "Callable[[Sample, FaultyDriver], Any] | None" = None  # what it makes of a sample
    refuse: "Callable[[FaultyDriver], None] | None" = None  # what `step` does first
    move: "Callable[[Setpoints, FaultyDriver], Setpoints] | None" = None  # what the arms follow
    deaf: bool = False  # takes no set-point any more: only the robot's watchdog can brake


class FaultyDriver(DriverWrapper):
    """Another driver with one fault from a time on. Its images are noise: no two are alike.

    Args:
        driver: the one behind it.
        fault: which one; none if None.
        at: when it sets in, s.
        rng: draws the images, and what a fault leaves to chance.
    """

    def __init__(
        self,
        driver: Driver,
        fault: DriverFault | None = None,
        at: float = 0.4,
        rng: np.random.Generator | None = None,
    ) -> None:
        super().__init__(driver)
        self._fault, self.at = fault, at
        self.rng = rng or np.random.default_rng(0)
        self.handed: list[Setpoints] = []  # every set-point, also those refused
        self.memory: dict[str, Any] = {}  # of the fault
        self.time = 0.0

    def read(self) -> Sample:
        """Return what the driver has, or what the fault makes of it."""
        sample = self.driver.read()
        sample = replace(sample, frames=tuple(self._noisy(f, sample) for f in sample.frames))
        fault = self._active
        return sample if fault is None or fault.spoil is None else fault.spoil(sample, self)

    def step(self, setpoints: Setpoints) -> None:
        """Note the set-points and hand them on, unless the fault has it otherwise."""
        self.handed.append(setpoints)
        fault = self._active
        if fault is not None and fault.refuse is not None:
            fault.refuse(self)
        if fault is not None and fault.move is not None:
            setpoints = fault.move(setpoints, self)
        self.driver.step(setpoints)
        self.time = len(self.handed) / self.inner_rate_hz

    @property
    def _active(self) -> DriverFault | None:
        return self._fault if self.time >= self.at else None

    def _noisy(self, frame: Frame, sample: Sample) -> Frame:
        camera = self.cameras[frame.camera]
        image = self.rng.integers(0, 255, (camera.height, camera.width), np.uint8)
        joints = {arm: state.position for arm, state in sample.joints.items()}
        return replace(frame, image=image, joints=joints)
