"""Features that nobody names are picked on the target, far apart, clear of what is behind it."""

import numpy as np

from vergence.assembly import assemble_parts
from vergence.cell import load_cell
from vergence.simulation import SimulatedDriver


def picked(position_m: str):
    settings = {"task.feature_count": "4", "target.position_m": position_m}
    cell = load_cell("puma560", settings)
    driver = SimulatedDriver(cell)
    parts = assemble_parts(cell, driver, True)
    points_px = parts.planner.reference(0.0).points_px
    places = driver.features
    driver.close()
    return points_px, places


def test_picked_features_are_far_apart():
    points_px, _ = picked("[0.06, -0.65, 0.18]")
    apart = np.linalg.norm(points_px[:, None] - points_px[None], axis=2)
    assert apart[np.triu_indices(4, 1)].min() >= 480 / 4


def test_picked_features_keep_their_windows_off_the_targets_edge():
    _, places = picked("[0.24, -0.65, 0.18]")  # its edge crosses the image
    half_window_m = 0.008  # 16 px at a metre, with this lens
    assert (np.abs(places[:, :2]) < 0.25 - half_window_m).all()
