"""What a tick of perception costs as cameras are added, [Lippiello2005] sections I and IV."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from vergence.assembly.measure import CornerWindows
from vergence.assembly.target_geometry import target_shape
from vergence.cell import Cell
from vergence.estimation import (
    Belief,
    CameraRig,
    PerceptionSettings,
    PoseFilter,
    PosePerception,
    TargetShape,
)
from vergence.estimation.filters.target_filter import Update
from vergence.estimation.view import Seen
from vergence.simulation import SimulatedDriver

BUDGET = 16
CAMERAS = (2, 64)  # few and many
_TICKS = 60


class Cost(NamedTuple):
    """Least over ticks, s: what it takes without what else the machine does meanwhile."""

    extraction: float  # measuring in windows
    update: float  # of the filter
    total: float  # of the whole tracking loop


@dataclass(slots=True)
class _Stopwatch:
    spent: float = 0.0

    def timed(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function, its time added up."""

        def call(*given: Any) -> Any:
            began = perf_counter()
            result = function(*given)
            self.spent += perf_counter() - began
            return result

        return call

    def lap(self) -> float:
        """Return what was spent since the last lap."""
        spent, self.spent = self.spent, 0.0
        return spent


class _TimedFilter:
    """The default filter, its updates timed: each the second time it is made.

    The first finds the processor's caches as the other stages left them, who have more to do the
    more cameras there are.
    """

    def __init__(self, watch: _Stopwatch) -> None:
        self._filter = PoseFilter()
        self.start, self.predict = self._filter.start, self._filter.predict
        self._timed = watch.timed(self._filter.update)

    def update(self, belief: Belief, seen: Seen) -> Update:
        """Return the update, which changes nothing but the clock."""
        self._filter.update(belief, seen)
        result: Update = self._timed(belief, seen)
        return result


class _TimedPerception:
    """Perception with copies of one camera, which all look at the same image.

    Args:
        cell: with a camera `fixed`.
        driver: of that cell.
        count: how many copies.
    """

    def __init__(self, cell: Cell, driver: SimulatedDriver, count: int) -> None:
        model = target_shape(cell, driver.world)
        T_world_camera = driver.world.camera_pose("fixed")
        self._image = driver.first_frame("fixed")
        self._names = [f"camera {n}" for n in range(count)]
        self._extraction, self._update = _Stopwatch(), _Stopwatch()
        cameras = dict.fromkeys(self._names, driver.cameras["fixed"])
        timed: Any = _TimedFilter(self._update)
        self._perception: PosePerception[Any] = PosePerception(
            CameraRig.of(cameras, cell.perception.noise_px),
            TargetShape.from_mesh(model.corners, model.vertices, model.triangles),
            lambda _camera, _joints: T_world_camera,
            self._extraction.timed(CornerWindows(model, cameras)),
            timed,
            timed.start(0.0, driver.world.target_pose()),
            settings=PerceptionSettings(budget=BUDGET, budget_in_doubt=BUDGET),
        )

    @property
    def lost(self) -> bool:
        """Whether it no longer follows its target, so that a tick costs nothing."""
        return bool(self._perception.lost)

    def tick(self, k: int) -> Cost:
        """Look at the k-th image with every camera."""
        frames = [replace(self._image, camera=name, time=k / 26.0) for name in self._names]
        began = perf_counter()
        self._perception.observe(frames)
        return Cost(self._extraction.lap(), self._update.lap(), perf_counter() - began)


def measure_costs(cell: Cell, counts: Sequence[int]) -> tuple[Cost, ...]:
    """Time perception with several numbers of cameras at a fixed budget of features.

    They take turns tick by tick, so that whatever else the machine does falls on all of them alike.
    NaN if one of them loses the target.

    Args:
        cell: with a camera `fixed`.
        counts: how many copies of that camera.
    """
    driver = SimulatedDriver(cell.replace(perception={"cameras": ["fixed"]}))
    try:
        rivals = [_TimedPerception(cell, driver, count) for count in counts]
    finally:
        driver.close()
    laps = np.array([[rival.tick(k) for rival in rivals] for k in range(_TICKS)])
    if any(rival.lost for rival in rivals):
        return (Cost(np.nan, np.nan, np.nan),) * len(counts)
    return tuple(Cost(*least) for least in laps[_TICKS // 4 :].min(axis=0))
