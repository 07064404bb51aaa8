"""A fixed camera that looks at the hand."""

from dataclasses import replace

from vergence.arrays import frozen
from vergence.control.law import Law
from vergence.signals import JointCommand, JointState, Observation, Reference


class EyeToHandLaw:
    """Lets a law made for a reversed arm move the arm itself.

    For features fixed in the hand, ṡ = L v with v the camera's twist as seen from the hand. The arm
    that carries the camera in the hand's frame is the arm walked backwards
    (`vergence.robot.reverse_arm`), so any law for a camera in the hand serves a camera on the wall;
    only the order of the joints has to be turned round.

    Args:
        law: made for the reversed arm.
    """

    def __init__(self, law: Law) -> None:
        self._law = law

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period, in the arm's own order."""
        backwards = JointState(
            joints.time, frozen(joints.position[::-1]), frozen(joints.velocity[::-1])
        )
        command = self._law.command(observation, reference, backwards)
        return replace(command, velocity=frozen(command.velocity[::-1]))
