"""The interface of a control law."""

from typing import Protocol

from vergence.signals import JointCommand, JointState, Observation, Reference


class Law(Protocol):
    """Computes joint rates from measured and desired features."""

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        ...
