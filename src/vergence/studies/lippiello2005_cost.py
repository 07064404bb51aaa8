"""What a tick of perception costs as cameras are added, [Lippiello2005] sections I and IV."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from vergence.camera import Frame
from vergence.cell import Cell, SimulatedDriver
from vergence.estimation import (
    CameraRig,
    PerceptionSettings,
    PoseFilter,
    PosePerception,
    TargetShape,
)
from vergence.runtime.assembly.measure import CornerWindows
from vergence.runtime.assembly.pose import target_shape

BUDGET = 16
_TICKS = 40


class Cost(NamedTuple):
    """Medians over ticks, s."""

    extraction: float  # measuring in windows
    update: float  # of the filter
    total: float  # of the whole inner circle


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
    """The default filter, its updates timed."""

    def __init__(self, watch: _Stopwatch) -> None:
        self._filter = PoseFilter()
        self.start, self.predict = self._filter.start, self._filter.predict
        self.update = watch.timed(self._filter.update)


def measure_cost(cell: Cell, count: int) -> Cost:
    """Time perception with many cameras at a fixed budget of features.

    The cameras are copies of the cell's fixed one, which all look at one rendered picture.

    Args:
        cell: with a camera `fixed`.
        count: how many copies.
    """
    driver = SimulatedDriver(cell.replace(perception={"cameras": ["fixed"]}))
    try:
        model = target_shape(cell, driver)
        driver.look_for(model.corners)
        picture = driver.first_frame("fixed")
        T_world_camera = driver.world.camera_pose("fixed")
        T_world_target = driver.world.target_pose()
        names = [f"camera {n}" for n in range(count)]
        cameras = dict.fromkeys(names, driver.cameras["fixed"])
    finally:
        driver.close()
    extraction, update = _Stopwatch(), _Stopwatch()
    timed: Any = _TimedFilter(update)
    perception = PosePerception(
        CameraRig.of(cameras, cell.perception.noise_px),
        TargetShape.from_mesh(model.corners, model.vertices, model.triangles),
        lambda _camera, _joints: T_world_camera,
        extraction.timed(CornerWindows(model, cameras)),
        timed,
        timed.start(0.0, T_world_target),
        settings=PerceptionSettings(budget=BUDGET, budget_in_doubt=BUDGET),
    )
    laps = [_tick(perception, picture, names, k, extraction, update) for k in range(_TICKS)]
    return Cost(*np.median(laps[_TICKS // 4 :], axis=0))


def _tick(
    perception: PosePerception[Any],
    picture: Frame,
    names: list[str],
    k: int,
    extraction: _Stopwatch,
    update: _Stopwatch,
) -> Cost:
    frames = [replace(picture, camera=name, time=k / 26.0) for name in names]
    began = perf_counter()
    perception.observe(frames)
    return Cost(extraction.lap(), update.lap(), perf_counter() - began)
