"""Cells that servo on curves, through rendered images alone."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import vergence as vg
from vergence.errors import InputError
from vergence.places import CELLS
from vergence.signals import curves_of


def test_a_cup_is_brought_to_the_middle_by_its_ellipse() -> None:
    run = vg.run("ellipse", duration_s=4.0)
    assert run.outcome.kind == "completed"
    trace = run.cameras["wrist"]
    assert trace.found.all()
    assert trace.joined.all()
    assert np.nanmax(trace.error_px[0]) > 100.0
    assert np.nanmax(trace.error_px[-1]) < 0.5
    assert np.nanmax(trace.drift_px) < 0.5  # against the true ellipse
    # The middle of the ellipse is in the middle of the image.
    np.testing.assert_allclose(trace.true_px[-1].mean(axis=0), [319.5, 239.5], atol=0.3)


def test_without_images_the_ellipse_is_that_of_the_features() -> None:
    run = vg.run("ellipse", duration_s=4.0, images=False)
    trace = run.cameras["wrist"]
    assert np.nanmax(trace.error_px[-1]) < 0.5
    assert np.nanmax(trace.drift_px) < 1e-6


def test_a_click_inside_is_enough() -> None:
    run = vg.run(
        "ellipse",
        duration_s=0.3,
        task={"points_px": [[400, 65]]},
        target={"features": None},
    )
    assert run.cameras["wrist"].found.all()
    assert run.cameras["wrist"].points_px.shape[1] == 16


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"target": {"features": None}}, "task.points_px"),
        ({"task": {"points_px": [[30, 300]]}}, "ellipse, "),
        ({"task": {"desired": [[1, 1], [2, 2], [3, 3], [4, 4], [5, 5]]}}, "task.desired"),
    ],
)
def test_a_curve_that_is_not_there_is_refused_before_anything_moves(change, message) -> None:
    with pytest.raises(InputError, match=message):
        vg.run("ellipse", duration_s=0.3, **change)


def test_two_cups_fix_all_six_directions_of_the_camera() -> None:
    run = vg.run("cups", duration_s=6.0)
    assert run.outcome.kind == "completed"
    trace = run.cameras["wrist"]
    assert trace.points_px.shape[1] == 32
    assert trace.found.all()
    assert [curve.closed for curve in curves_of(trace.joined[-1])] == [True, True]
    for cup in (slice(0, 16), slice(16, 32)):
        assert np.nanmax(trace.error_px[0, cup]) > 100.0
        assert np.nanmax(trace.error_px[-1, cup]) < 0.5
    assert np.nanmax(trace.drift_px) < 1.0  # against the true ellipses
    exact = vg.run("cups", duration_s=6.0, images=False).cameras["wrist"]
    difference = trace.T_world_camera[-1] - exact.T_world_camera[-1]
    assert np.abs(difference[:3, 3]).max() < 2e-3
    assert np.abs(difference[:3, :3]).max() < 5e-3


def test_a_click_inside_each_cup_is_enough() -> None:
    clicks = [[430, 225], [471, 67]]
    change = {"points_px": clicks, "desired": "initial"}
    run = vg.run("cups", duration_s=0.3, task=change, target={"features": None})
    trace = run.cameras["wrist"]
    assert trace.found.all()
    middles = trace.points_px[0].reshape(2, 16, 2).mean(axis=1)
    np.testing.assert_allclose(middles, clicks, atol=8.0)
    change["points_px"] = [[430, 225], [432, 226]]
    with pytest.raises(InputError, match="ellipse 1 and 2 are the same"):
        vg.run("cups", duration_s=0.3, task=change, target={"features": None})


def test_a_plate_over_one_cup_loses_that_cup_alone(tmp_path: Path) -> None:
    """Without limits: with them, the arm would keep the plate out of the way."""
    cell = shutil.copytree(CELLS / "cups", tmp_path / "cups")
    plate = '<geom type="box" size="0.012 0.012 0.001" pos="0.347 -0.037 0.243"/></worldbody>'
    table = (cell / "table.xml").read_text()
    (cell / "table.xml").write_text(table.replace("</worldbody>", plate))
    law = {"kind": "image_based", "feature": "ellipse", "gain": 2.0, "solver": "pseudo_inverse"}
    run = vg.run(str(cell), duration_s=4.0, law=law)
    assert run.outcome.kind == "completed"
    trace = run.cameras["wrist"]
    assert trace.found[:, :16].all()
    assert np.nanmax(trace.error_px[-1, :16]) < 1.0
    lost = ~trace.found[:, 16]
    assert 10 < lost.sum() < len(lost) - 10
    reasons = {trace.reasons[row][16] for row in np.flatnonzero(lost)}
    assert all(reason.startswith("not an ellipse: ") for reason in reasons)


def test_a_strip_is_followed_along_its_edges() -> None:
    run = vg.run("line", duration_s=8.0)
    assert run.outcome.kind == "completed"
    trace = run.cameras["wrist"]
    late = trace.time > 4.0
    assert np.nanmax(trace.error_px[0]) > 50.0
    assert np.nanmax(trace.error_px[late]) < 2.0
    assert np.nanmax(trace.drift_px) < 0.6  # against the true edges
    way = trace.T_world_camera[:, :3, 3]
    travelled = np.linalg.norm(way[-1] - way[late][0])
    assert travelled == pytest.approx(0.0506 * (trace.time[-1] - trace.time[late][0]), rel=0.1)


def test_a_plate_over_one_edge_loses_that_edge_alone() -> None:
    """It covers more than half of what is looked at, for a moment."""
    trace = vg.run("line", duration_s=6.0).cameras["wrist"]
    assert trace.found[:, :2].all()
    lost = ~trace.found[:, 2]
    assert trace.found[-1].all()
    reasons = {trace.reasons[row][2] for row in np.flatnonzero(lost)}
    assert all(reason.startswith("no line: ") for reason in reasons)


def test_a_leaf_is_followed_in_six_directions_by_moments_of_its_region() -> None:
    run = vg.run("leaf", duration_s=6.0)
    assert run.outcome.kind == "completed"
    trace = run.cameras["wrist"]
    assert trace.found.all()
    assert np.nanmax(trace.error_px[0]) > 50.0
    settled = (trace.time > 3.5) & (trace.time < 4.0)
    # Not smoothed, the outline is known to a pixel at each place; its moments far better.
    assert np.nanmax(trace.error_px[settled]) < 2.0
    middle = trace.true_px[settled].mean(axis=1)
    assert np.abs(middle - middle.mean(axis=0)).max() < 0.3
    assert np.nanmax(trace.error_px[trace.time > 4.0]) < 25.0


@pytest.mark.parametrize(("cell", "limit_px"), [("line", 0.1), ("leaf", 0.5)])
def test_without_images_curves_are_those_of_the_features(cell: str, limit_px: float) -> None:
    run = vg.run(cell, duration_s=4.0, images=False)
    trace = run.cameras["wrist"]
    assert run.outcome.kind == "completed"
    assert np.nanmax(trace.error_px[-1]) < 3.0
    assert np.nanmax(trace.drift_px) < limit_px
