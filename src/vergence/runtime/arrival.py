"""Detects whether a run reaches its goal, or comes to rest before it and why."""

from collections import Counter, deque
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.runtime import endings
from vergence.signals import ImagePoints, JointCommand, Observation, Outcome, Reference

_WINDOW_S = 1.0  # for averaging errors and judging rest
_FALLING = 0.1  # smallest relative decrease of the error, over half a window, to be falling
_FALLING_PX = 0.01  # and the smallest absolute one
_NO_LIMIT = (
    "no limit: this is a local minimum of the law, or its features do not "
    "determine the rest of the motion"
)
_REST = 1e-3  # fraction of the rate limits below which an arm is at rest
_FASTEST = 10.0  # rad/s or m/s: the limits of a model without real ones may be ten times that
_DESIRED_MOVED_PX = 0.1  # in a window, below which the desired features are at rest


class Goal(NamedTuple):
    """The conditions under which a task is reached.

    Attributes:
        tolerance_px: largest distance of any feature from its desired point, averaged over a
            second.
        ends: true if the task ends at its goal; if false, it continues until its time is over.
    """

    tolerance_px: float = 1.0
    ends: bool = False


class _Row(NamedTuple):
    """The values of one image."""

    time: float  # s
    points_px: FloatArray  # (M, 2) measured; NaN where not found
    goal_px: FloatArray  # (M, 2) where the law would have them
    desired_px: FloatArray  # (M, 2) of the reference
    q: FloatArray  # (n,)
    active: tuple[str, ...]

    @property
    def error_px(self) -> FloatArray:
        """Measured less desired, (M, 2); NaN where not found."""
        return self.points_px - self.goal_px


class Arrival:
    """Monitors the error and the joints of a run.

    A run is stalled if the arm and the desired features have been at rest for a second while the
    mean error is above the tolerance and no longer falling. A target that moves away from an arm
    that no limit holds does not count as a stall: the arm is about to follow.

    Args:
        goal: of the task.
        rate_max: rate limits of the joints, (n,).
    """

    def __init__(self, goal: Goal, rate_max: FloatArray) -> None:
        self._goal, self._rate_max = goal, rate_max
        self._rows: deque[_Row] = deque()

    def observe(
        self, observation: Observation, reference: Reference, command: JointCommand, q: FloatArray
    ) -> None:
        """Add an image's observation, reference and command, at joint positions q (n,)."""
        views = [view for view in observation.views if view.camera not in reference.elsewhere_px]
        if reference.points_px is None or not views:
            return
        view: ImagePoints = views[-1]
        if view.points_px.shape != reference.points_px.shape:
            return
        if self._rows and self._rows[-1].desired_px.shape != reference.points_px.shape:
            self._rows.clear()  # the features have changed
        goal = command.reference or reference
        assert goal.points_px is not None
        points_px = np.where(view.found[:, None], view.points_px, np.nan)
        row = _Row(
            view.time, points_px, goal.points_px, reference.points_px, q.copy(), command.active
        )
        self._rows.append(row)
        while self._rows[0].time < view.time - _WINDOW_S:
            self._rows.popleft()

    @property
    def error_px(self) -> float:
        """Mean distance of the farthest feature from its desired point; NaN before any is known."""
        return _mean_error(list(self._rows))

    @property
    def falls(self) -> bool:
        """Whether the error is still falling."""
        before, now = self._halves()
        return before - now > max(_FALLING * before, _FALLING_PX)

    @property
    def points_px(self) -> FloatArray:
        """Mean position of each feature over the last second, (M, 2); NaN where not found."""
        places = np.array([row.points_px for row in self._rows])
        counts = np.isfinite(places).all(axis=2).sum(axis=0)
        total = np.where(np.isfinite(places), places, 0.0).sum(axis=0)
        mean: FloatArray = np.where(counts, total.T / np.maximum(counts, 1), np.nan).T
        return mean

    @property
    def reached(self) -> bool:
        """Whether the mean error is within the tolerance."""
        return self.error_px <= self._goal.tolerance_px

    @property
    def stalled(self) -> bool:
        """Whether the arm is at rest away from its goal and the error no longer falls."""
        away = self._rests() and self.error_px > self._goal.tolerance_px
        return away and not self.falls and not self._leaves()

    @property
    def active(self) -> tuple[str, ...]:
        """The limits that were active in most of the recent images."""
        counts = Counter(name for row in self._rows for name in row.active)
        return tuple(name for name, count in counts.items() if 2 * count > len(self._rows))

    def holder(self) -> str:
        """Return what holds a stalled run."""
        held = list(self.active)
        if _mirrored(self._rows[-1]):
            held.append("a goal that shows the mirror image of the features seen")
        return " and ".join(held) or _NO_LIMIT

    def outcome(self, duration_s: float, time: float) -> Outcome:
        """Return the outcome of a run whose time is over."""
        if self.stalled:
            return endings.not_reached(self.error_px, f"held by {self.holder()}", time)
        if not self._goal.ends:
            return endings.completed(duration_s, time)
        if self.reached:
            return endings.reached(self.error_px, time)
        return endings.not_reached(self.error_px, "out of time", time)

    def _halves(self) -> tuple[float, float]:
        """Return the mean errors of the first and the second half of the window, px."""
        rows = list(self._rows)
        half = len(rows) // 2
        return _mean_error(rows[:half]), _mean_error(rows[half:])

    def _leaves(self) -> bool:
        """Whether the target has begun to move away, and nothing keeps the arm from following."""
        before, now = self._halves()
        return not self.active and now - before > max(_FALLING * before, _FALLING_PX)

    def _rests(self) -> bool:
        if not self._rows or self._rows[-1].time - self._rows[0].time < 0.9 * _WINDOW_S:
            return False
        first, last = self._rows[0], self._rows[-1]
        positions = np.array([row.q for row in self._rows])
        moved = np.ptp(positions, axis=0) / (np.minimum(self._rate_max, _FASTEST) * _WINDOW_S)
        desired = np.abs(last.desired_px - first.desired_px).max(initial=0.0)
        return bool(moved.max() < _REST and desired < _DESIRED_MOVED_PX)


def _mean_error(rows: list[_Row]) -> float:
    """Return the mean distance of the farthest feature from its desired point, NaN if none."""
    if not rows:
        return float("nan")
    errors = np.array([row.error_px for row in rows])
    known = np.isfinite(errors).all(axis=2)
    counts = known.sum(axis=0)
    total = np.where(known[:, :, None], errors, 0.0).sum(axis=0)
    if not counts.any():
        return float("nan")
    return float(np.linalg.norm(total[counts > 0] / counts[counts > 0, None], axis=1).max())


def _mirrored(row: _Row) -> bool:
    """Return whether the best affine map from measured to desired features is a reflection."""
    seen = np.isfinite(row.points_px).all(axis=1)
    if seen.sum() < 3:
        return False
    desired, now = row.goal_px[seen], row.points_px[seen]
    now, desired = now - now.mean(axis=0), desired - desired.mean(axis=0)
    scatter = now.T @ now
    if np.linalg.det(scatter) < 1e-6 * np.trace(scatter) ** 2:
        return False
    return bool(np.linalg.det(np.linalg.solve(scatter, now.T @ desired)) < 0.0)
