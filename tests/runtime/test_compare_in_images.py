"""Campaigns of a cell whose camera has imaging look through rendered images."""

import pytest

from vergence.experiments import CellSource, Ending, Sampling, run_trials, start_trials
from vergence.experiments.kinematic import is_ideal

SHORT = {
    "duration_s": "0.5",
    "task.feature_count": "2",
    "target.motion": "{ kind = 'stationary' }",
    "inner_rate_hz": "100",
}


@pytest.mark.parametrize("imaging", ["ideal", "real_camera"])
def test_a_camera_with_imaging_is_looked_through(imaging: str) -> None:
    source = CellSource.of("puma560", SHORT | {"cameras.wrist.imaging": imaging}, None)
    cell = source.load()
    trials = start_trials(cell, ["constrained"], 1, seed=3, sampling=Sampling(spread=0.01))
    assert not is_ideal(cell.replace(**trials[0].changes))
    [in_images] = run_trials(source, trials, tolerance_px=5.0)
    [again] = run_trials(source, trials, tolerance_px=5.0)
    assert in_images == again
    assert in_images.ending is Ending.CONVERGED, in_images.outcome
    exact = CellSource.of("puma560", SHORT, None)
    [projected] = run_trials(exact, trials, tolerance_px=5.0, physics=True)
    assert projected.final_error_px != in_images.final_error_px
