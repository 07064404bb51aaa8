"""Several targets, each tracked by its own filter, in the images of the same cameras."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from vergence.estimation.held_target import FollowedPose
from vergence.signals import Frame, Observation


class _Perception(Protocol):
    def observe(self, frames: tuple[Frame, ...]) -> Observation | None: ...


class SeveralTargets:
    """Tracks the other targets of a cell in addition to the task's.

    Observations of the others are delivered with the next observation of the task's target; the
    loop does not hold the arm for any of them.

    Args:
        perception: of the task's target.
        others: perceptions of the others, by name.
    """

    def __init__(self, perception: _Perception, others: Mapping[str, FollowedPose]) -> None:
        self._perception, self._others = perception, others
        self._seen: dict[str, Observation] = {}  # since the last observation

    def observe(self, frames: Sequence[Frame]) -> Observation | None:
        """Return the observation in the images with all targets, or None without an image."""
        observation = self._perception.observe(tuple(frames))
        for name, other in self._others.items():
            if (seen := other.observe(frames)) is not None:
                self._seen[name] = seen
        if observation is None:
            return None
        others, self._seen = self._seen, {}
        return replace(observation, others=others)
