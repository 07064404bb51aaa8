"""What the loop asks of a control law."""

from typing import Protocol

from vergence.control.command import JointCommand
from vergence.features import Observation
from vergence.planning import Reference
from vergence.robot import JointState


class Law(Protocol):
    """Turns what is seen and what is wanted into joint rates."""

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        ...
