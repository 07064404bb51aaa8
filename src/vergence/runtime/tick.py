"""What the loop reports to its listeners at every tick."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from vergence.signals import JointCommand, Observation, Reference, Sample, Setpoint


@dataclass(frozen=True, slots=True)
class TickRecord:
    """One turn of the outer loop: inputs, desired values and outputs."""

    time: float  # s since the start of the run
    sample: Sample  # joints and the images that arrived
    observation: Observation | None  # of the images; None if none arrived
    reference: Reference | None  # of the law
    commands: Mapping[str, JointCommand]  # by arm; empty while the cell holds
    # The last set-point of each arm: the positions it should have now.
    setpoints: Mapping[str, Setpoint] = field(default_factory=dict)
