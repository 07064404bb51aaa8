"""Cells with a depth camera: the law goes by what it measures, and carries what it does not."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vergence.assembly import run_cell, run_driver
from vergence.cell import Cell, load_cell
from vergence.errors import InputError
from vergence.runtime.driver_wrapper import DriverWrapper
from vergence.signals import OutcomeKind, Sample
from vergence.simulation import SimulatedDriver

SMALL = {
    "cameras.wrist.resolution": "[320, 240]",
    "cameras.wrist.pixel_um": "[16.6, 16.6]",
    "duration_s": "2.5",
}
DEPTH = {"cameras.wrist.depth": "{ noise_m = 0.003, holes = 0.1 }"}


def unknown_board(**keys: str) -> Cell:
    """The UR5 over its wandering board, of which no features are known."""
    cell = load_cell("ur5", SMALL | keys)
    return cell.with_target(features=None)


def error_px(cell: Cell) -> float:
    run = run_cell(cell)
    assert run.outcome.kind is OutcomeKind.COMPLETED
    errors = run.cameras["wrist"].error_px
    return float(np.nanmax(errors[len(errors) // 2 :]))


def test_measured_depth_follows_a_moving_target_whatever_was_believed() -> None:
    held = error_px(unknown_board(**{"law.depth_m": "0.25", "law.depth": '"held"'}))
    measured = error_px(unknown_board(**DEPTH, **{"law.depth_m": "0.25"}))
    assert measured < 5.0
    assert held > 4.0 * measured


def test_a_depth_image_is_the_truth_with_holes_and_noise_that_grows() -> None:
    cell = load_cell("ur5", SMALL | {"cameras.wrist.depth": "{ noise_m = 0.01, holes = 0.2 }"})
    driver = SimulatedDriver(cell)
    frame = driver.first_frame("wrist")
    exact = SimulatedDriver(load_cell("ur5", SMALL | {"cameras.wrist.depth": "{ noise_m = 0 }"}))
    true = exact.first_frame("wrist").depth_m
    driver.close()
    exact.close()
    assert frame.depth_m is not None
    assert true is not None
    truth = frame.truth
    assert truth is not None
    for (u, v), depth in zip(np.rint(truth.points_px).astype(int), truth.depth_m, strict=True):
        assert true[v, u] == pytest.approx(depth, abs=2e-3)
    known = np.isfinite(frame.depth_m)
    assert 0.15 < 1.0 - known.mean() < 0.25
    scatter = ((frame.depth_m - true) / true**2)[known]
    assert scatter.std() == pytest.approx(0.01, rel=0.05)


class Blind(DriverWrapper):
    """Takes the depth away."""

    def read(self) -> Sample:
        sample = self.driver.read()
        return replace(sample, frames=tuple(replace(f, depth_m=None) for f in sample.frames))


def test_what_has_no_depth_camera_is_refused_by_name() -> None:
    with pytest.raises(
        InputError, match=r"law.depth: given from_camera; .*\[cameras.wrist.depth\]"
    ):
        run_cell(load_cell("ur5", SMALL | {"law.depth": '"from_camera"'}))
    cell = load_cell("ur5", SMALL | DEPTH)
    driver = Blind(SimulatedDriver(cell))
    try:
        with pytest.raises(InputError, match=r"cameras.wrist.depth: no depth image"):
            run_driver(cell, driver, (), True)
    finally:
        driver.close()


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("{ range_m = [2.0, 1.0] }", "nearest, farthest"),
        ("{ noise_m = -1 }", "noise_m"),
        ("{ noise = 1 }", "did you mean noise_m"),
    ],
)
def test_bad_numbers_are_named(table: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        load_cell("ur5", {"cameras.wrist.depth": table})


def test_a_depth_image_of_another_size_is_a_bad_sample() -> None:
    class Cropped(DriverWrapper):
        def read(self) -> Any:
            sample = self.driver.read()
            cut = (replace(f, depth_m=f.depth_m[:100]) for f in sample.frames)  # type: ignore[index]
            return replace(sample, frames=tuple(cut))

    cell = load_cell("ur5", SMALL | DEPTH)
    driver = Cropped(SimulatedDriver(cell))
    outcome = run_driver(cell, driver, (), True).outcome
    driver.close()
    assert outcome.kind is OutcomeKind.BAD_SAMPLE
    assert "depth image of wrist is float32, shape (100, 320)" in outcome.reason
