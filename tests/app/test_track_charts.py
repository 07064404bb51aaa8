"""Charts and page of tracked footage that no camera has taken: far turns, gaps, odd names."""

import re
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from vergence.app.figures import chart_svg
from vergence.app.figures.tracked import curve_chart, position_chart, rotation_chart
from vergence.app.tracking.curve_kinds import KINDS
from vergence.app.tracking.track_page import make_track_page
from vergence.app.tracking.track_record import TrackedCurve, TrackedPose, TrackRecord
from vergence.estimation.known_object.object_follower import Sighting
from vergence.geometry import so3_exp, so3_log
from vergence.signals import Outcome, OutcomeKind


def made_up(seen: tuple[Sighting, ...], turns: np.ndarray, covariance: np.ndarray) -> TrackRecord:
    """Return a pose that turns in place, 0.5 m away."""
    count = len(seen)
    whole = np.tile(1e-6 * np.eye(6), (count, 1, 1))
    whole[:, 3:, 3:] = covariance
    place = np.tile([0.0, 0.0, 0.5], (count, 1))
    pose = TrackedPose(seen, ("",) * count, np.ones(count), place, turns, whole)
    outcome = Outcome(OutcomeKind.COMPLETED, "made up", 1.0)
    names = tuple(f"{k}.png" for k in range(count))
    time = 0.1 * np.arange(count)
    return TrackRecord(Path(), {"images": "made-up"}, outcome, names, time, pose, ())


def test_the_band_of_a_rotation_is_its_standard_deviation_however_far_it_has_turned() -> None:
    rng = np.random.default_rng(3)
    R0, turn = so3_exp(np.array([0.4, -0.2, 0.1])), np.array([1.2, -1.5, 0.8])
    spread = np.diag([0.01, 0.02, 0.005])
    R1 = so3_exp(turn) @ R0
    record = made_up((Sighting.SEEN,) * 2, np.stack((R0, R1)), spread**2)
    panels = rotation_chart(record, record.pose).panels
    drawn = [0.5 * (panel.bands[0].high[1] - panel.bands[0].low[1]) for panel in panels]
    errors = rng.standard_normal((20000, 3)) @ spread
    sampled = [so3_log(np.ascontiguousarray(so3_exp(error) @ R1 @ R0.T)) for error in errors]
    np.testing.assert_allclose(drawn, np.degrees(np.std(sampled, axis=0)), rtol=0.03)


def test_a_line_is_broken_where_an_angle_comes_back_on_the_other_side() -> None:
    turns = np.array([so3_exp(np.array([0.0, 0.0, 0.5 * k])) for k in range(10)])
    record = made_up((Sighting.SEEN,) * 10, turns, 1e-6 * np.eye(3))
    yaw = rotation_chart(record, record.pose).panels[2].curves[0].y
    assert np.flatnonzero(np.isnan(yaw)).tolist() == [7]  # 3.5 rad
    assert np.nanmax(np.abs(yaw)) < 180.0
    assert np.nanmax(np.abs(np.diff(yaw))) == pytest.approx(np.degrees(0.5))


def test_angles_of_axes_are_drawn_past_half_a_turn() -> None:
    angle = np.deg2rad(np.arange(60.0, 130.0, 10.0))
    values = np.tile([9.0, 9.0, 4.0, 2.0, 0.0], (7, 1))
    values[:, 4] = 0.5 * np.pi - (0.5 * np.pi - angle) % np.pi
    values[3] = np.nan
    found = np.arange(7) != 3
    curve = TrackedCurve(
        1, "ellipse", KINDS["ellipse"], found, ("",) * 7, values, np.full((7, 5), 0.01)
    )
    record = made_up((Sighting.SEEN,) * 7, np.tile(np.eye(3), (7, 1, 1)), np.eye(3))
    drawn = curve_chart(record, curve).panels[4].curves[0].y
    np.testing.assert_allclose(drawn[found], np.degrees(angle[found]))


def test_a_curve_that_is_found_once_is_a_dot_and_bands_stay_within_their_axes() -> None:
    states = [Sighting.PREDICTED] * 8
    states[0] = states[5] = Sighting.SEEN
    record = made_up(tuple(states), np.tile(np.eye(3), (8, 1, 1)), np.eye(3))
    record.pose.covariance[1:5] *= 100.0
    html = chart_svg(position_chart(record, record.pose), "a chart")
    svg = ET.fromstring(html[html.index('<svg class="chart"') :])
    seen = [path.attrib["d"] for path in svg.iter("path") if path.attrib["class"] == "curve c0 "]
    assert all(len(re.findall("M", d)) == 2 == len(re.findall("L", d)) for d in seen)
    bands = [one for one in svg.iter("path") if one.attrib["class"].endswith("band")]
    assert len(bands) == 3
    for band in bands:
        y = np.array(re.findall(r"[ML][\d.]+ ([\d.]+)", band.attrib["d"]), dtype=float)
        assert len(y) == 16
        assert np.ptp(y) == pytest.approx(140.0, abs=0.2)  # to both ends of the panel


def test_a_pose_that_was_never_measured_is_not_drawn() -> None:
    record = made_up((Sighting.PREDICTED,) * 3, np.tile(np.eye(3), (3, 1, 1)), np.eye(3))
    assert position_chart(record, record.pose) is None
    assert rotation_chart(record, record.pose) is None
    assert "predicted</b>" in make_track_page(record, Path())


def test_names_of_files_are_text_in_the_page() -> None:
    record = made_up((Sighting.SEEN,) * 2, np.tile(np.eye(3), (2, 1, 1)), np.eye(3))
    record.answer["images"] = "<script>alert(1)</script>"
    assert "<script>alert" not in make_track_page(record, Path())
