"""A run on an arm that follows commands exactly, before exact projections."""

from dataclasses import dataclass, field

import numpy as np

from vergence.arrays import FloatArray
from vergence.control import Law
from vergence.planning import FixedReference
from vergence.robot import Clearance
from vergence.runtime import Loop, Run, RunInfo, RunRecorder, Timeouts
from vergence.signals import Reference
from vergence.simulation import ExactPoints, KinematicCell, KinematicDriver
from vergence.simulation.kinematic_driver import ARM, CAMERA


@dataclass(frozen=True, slots=True)
class KinematicRun:
    """One run: by itself in the loop, or among many in `run_batch`, with the same result."""

    cell: KinematicCell
    law: Law  # of its own: a law remembers
    desired_px: FloatArray  # (M, 2) where the features are to be
    duration_s: float
    noise_px: float = 0.0  # standard deviation on each coordinate
    timeouts: Timeouts = field(default_factory=Timeouts)
    desired_depth_m: FloatArray | None = None  # (M,) of the features there, if known
    clearance: Clearance | None = None  # what the arm must keep clear of; nothing if None

    @property
    def reference(self) -> Reference:
        """What the law is to reach."""
        return Reference(0.0, self.desired_px, desired_depth_m=self.desired_depth_m)

    def noise(self) -> np.random.Generator:
        """Return what draws the noise."""
        return np.random.default_rng([self.cell.seed, 3])

    def in_loop(self) -> Run:
        """Make the run in the loop."""
        driver, recorder = KinematicDriver(self.cell), RunRecorder()
        recorder.begin(RunInfo.of(driver, "ideal", "", self.cell.seed, CAMERA))
        loop = Loop(
            driver,
            ARM,
            ExactPoints(CAMERA, self.noise_px, self.noise()),
            FixedReference(self.reference),
            self.law,
            outer_rate_hz=self.cell.rate_hz,
            listeners=[recorder],
            timeouts=self.timeouts,
            clearance=self.clearance,
        )
        recorder.close(loop.run(self.duration_s), {})
        return recorder.run()
