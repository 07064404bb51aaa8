"""What the loop asks of a control law."""

from typing import Protocol

from vergence.signals import JointCommand, JointState, Observation, Reference


class Law(Protocol):
    """Turns what is seen and what is desired into joint rates."""

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        ...
