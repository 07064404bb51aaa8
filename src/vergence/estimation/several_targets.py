"""Several targets, each followed by a filter of its own, in the images of the same cameras."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from vergence.estimation.held_target import FollowedPose
from vergence.signals import Frame, Observation


class _Perception(Protocol):
    def observe(self, frames: tuple[Frame, ...]) -> Observation | None: ...


class SeveralTargets:
    """Follows the other targets of a cell beside the one that the task is about.

    What is observed of them comes with the next observation of that one; the loop does not hold
    the arm for any of them.

    Args:
        perception: of the task's target.
        others: follow the others, by name.
    """

    def __init__(self, perception: _Perception, others: Mapping[str, FollowedPose]) -> None:
        self._perception, self._others = perception, others
        self._seen: dict[str, Observation] = {}  # since the last observation

    def observe(self, frames: Sequence[Frame]) -> Observation | None:
        """Return what the images show, and where the targets are, or None without an image."""
        observation = self._perception.observe(tuple(frames))
        for name, other in self._others.items():
            if (seen := other.observe(frames)) is not None:
                self._seen[name] = seen
        if observation is None:
            return None
        others, self._seen = self._seen, {}
        return replace(observation, others=others)
