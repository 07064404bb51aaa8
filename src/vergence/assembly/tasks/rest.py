"""Between two tasks: the arm comes to rest, and the next task is put together from what it sees."""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.planning.approach.worker import Worker
from vergence.signals import (
    Frame,
    JointCommand,
    JointState,
    Observation,
    Outcome,
    OutcomeKind,
    Reference,
)

_WINDOW_S = 0.2  # over which the joints have to stay
_MOVED = 1.5e-3  # rad or m, within which they do: more than a step of any encoder
_LONGEST_S = 5.0  # until they have to


class Rest:
    """Perception, planner and law of an arm that waits for its next task.

    It asks for rest, within the limits that the guard keeps. Once the joints stay, and every camera
    has delivered an image that was exposed since, the next task is prepared.

    Args:
        cameras: whose images the next task begins with.
        prepare: makes it of those, by camera; it is done by the worker.
        worker: does it.

    Attributes:
        prepared: what came of it; None before the task is over.
    """

    def __init__(
        self,
        cameras: Sequence[str],
        prepare: Callable[[Mapping[str, Frame]], Any],
        worker: Worker,
    ) -> None:
        self._cameras, self._prepare, self._worker = cameras, prepare, worker
        self._frames: dict[str, Frame] = {}  # the newest
        self._stays: deque[tuple[float, FloatArray]] = deque()  # time and joints, oldest first
        self._asked = False
        self._begun: float | None = None
        self.prepared: Any = None

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Keep the newest image of each camera."""
        self._frames |= {frame.camera: frame for frame in frames}
        if not frames:
            return None
        return Observation(frames[-1].time, (), needs_target=False)

    def reference(self, time: float) -> Reference:
        """Return that nothing is desired."""
        return Reference(time)

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return rates of zero, and take note of where the arm is."""
        self._stays.append((joints.time, joints.position))
        while len(self._stays) > 1 and self._stays[1][0] <= joints.time - _WINDOW_S:
            self._stays.popleft()
        return JointCommand(np.zeros(len(joints.position)), np.zeros(6))

    def conclusion(self, time: float) -> Outcome | None:
        """Return that the next task may begin, once it is prepared."""
        self._begun = time if self._begun is None else self._begun
        if not self._asked and self._stands(time):
            self._asked = True
            frames = {name: self._frames[name] for name in self._cameras}
            self._worker.ask(lambda: self._prepare(frames))
        if self._asked:
            self.prepared = self._worker.answer()
        if self.prepared is not None:
            return Outcome(OutcomeKind.REACHED, "the next task is ready", time)
        if not self._asked and time - self._begun > _LONGEST_S:
            reason = f"the arm does not come to rest within {_LONGEST_S:g} s"
            return Outcome(OutcomeKind.NOT_REACHED, reason, time)
        return None

    def unfinished(self, time: float) -> Outcome:
        """Return how it ends if the time of the run is over."""
        return Outcome(OutcomeKind.NOT_REACHED, "the time of the run is over before it", time)

    def events(self) -> tuple[()]:
        """Return that nothing happened."""
        return ()

    def _stands(self, time: float) -> bool:
        """Whether the joints stay, and there is an image from there of every camera."""
        if not self._stays or self._stays[0][0] > time - _WINDOW_S:
            return False
        moved = np.ptp(np.array([q for _, q in self._stays]), axis=0).max()
        since = self._stays[0][0]
        newest = [self._frames.get(name) for name in self._cameras]
        return bool(moved < _MOVED) and all(f is not None and f.time >= since for f in newest)
