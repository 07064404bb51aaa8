"""A path that is replanned when the arm stalls."""

from collections.abc import Callable
from typing import Protocol

from vergence.arrays import FloatArray
from vergence.planning.approach.worker import Worker
from vergence.planning.from_now import FromNow
from vergence.planning.trajectory import Trajectory
from vergence.signals import Reference

# A path from the features (M, 2), px, and joints (n,) at a stall, or why there is none.
PlanFromHere = Callable[[FloatArray, FloatArray], Trajectory | str]

MOST_PLANS = 3  # after the first, before a stall ends the run


class _References(Protocol):
    def reference(self, time: float) -> Reference: ...


class Replanner:
    """Returns the references of a path, and of another one after the arm stalls before its end.

    Args:
        first: initial references: a path, or the goal itself.
        plan: finds a path from where the arm stalled.
        worker: runs it, since it may take longer than an image.
    """

    def __init__(self, first: _References, plan: PlanFromHere, worker: Worker) -> None:
        self._references, self._plan, self._worker = first, plan, worker
        self._plans = 0
        self._stalled_at = 0.0  # s
        self._added_s = 0.0
        self._told: list[tuple[float, str, str]] = []

    def begin_later(self) -> None:
        """Let the first path begin at the first request rather than at time 0."""
        if isinstance(self._references, Trajectory):
            self._references = FromNow(self._references)

    def reference(self, time: float) -> Reference:
        """Return the reference at a time, s."""
        answer = self._worker.answer()
        if isinstance(answer, Trajectory):
            self._references = FromNow(answer)
            self._added_s += time - self._stalled_at + answer.duration
            length = answer.path.camera_length_m
            text = f"{length:.3f} m in {answer.duration:.1f} s, from where the arm stalled"
            self._told.append((time, "path planned", text))
        elif answer is not None:
            self._told.append((time, "no path", f"from where the arm stalled: {answer}"))
        return self._references.reference(time)

    def stalled(self, time: float, points_px: FloatArray, q: FloatArray) -> None:
        """Replan, unless that has been done too often.

        Args:
            time: now, s.
            points_px: positions of the features, (M, 2).
            q: joint positions, (n,).
        """
        if self._plans >= MOST_PLANS or self._worker.busy:
            return
        self._plans += 1
        self._stalled_at = time
        points_px, q = points_px.copy(), q.copy()
        self._worker.ask(lambda: self._plan(points_px, q))

    @property
    def added_s(self) -> float:
        """The time spent on stalls and the paths planned after them, s."""
        return self._added_s

    def events(self) -> list[tuple[float, str, str]]:
        """Return the events since the last call: time in s, name, and a sentence."""
        told, self._told = self._told, []
        return told
