"""Figures name their units, keep legends off the data, and draw what was recorded."""

from dataclasses import replace

import numpy as np
import pytest

from vergence.app.figures import (
    Panels,
    camera_figure,
    error_figure,
    estimate_figure,
    joints_figure,
    mark_events,
    measures_figure,
    paths_figure,
    svg,
    target_figure,
    twist_figure,
)
from vergence.app.figures.arm import drawn_positions, normalized
from vergence.geometry import se3_exp
from vergence.runtime import ArmInfo
from vergence.runtime.recording import Recording
from vergence.runtime.results import Event, TargetTrace

FIGURES = ["error", "paths", "joints", "twist", "measures", "camera", "target"]


def figure(name: str, recording: Recording) -> Panels:
    camera, arm = recording.cameras["wrist"], recording.arms["puma"]
    made = {
        "error": lambda: error_figure(camera),
        "paths": lambda: paths_figure(recording.info.cameras["wrist"], camera),
        "joints": lambda: joints_figure(recording.info.arms["puma"], arm),
        "twist": lambda: twist_figure(arm),
        "measures": lambda: measures_figure(arm),
        "camera": lambda: camera_figure(camera),
        "target": lambda: target_figure(camera, recording.target),
    }[name]()
    assert made is not None
    return made


@pytest.mark.parametrize("name", FIGURES)
def test_every_axis_says_what_and_in_which_unit(name: str, recording: Recording) -> None:
    made = figure(name, recording)
    assert all("(" in axes.get_ylabel() for axes in made.axes)
    assert "(" in made.axes[-1].get_xlabel()


@pytest.mark.parametrize("name", FIGURES)
def test_legends_lie_beside_the_data(name: str, recording: Recording) -> None:
    made = figure(name, recording)
    made.figure.draw_without_rendering()
    for axes in made.axes:
        if (legend := axes.get_legend()) is not None:
            beside = legend.get_window_extent().x0 >= axes.get_window_extent().x1
            inside = legend.get_window_extent().x1 <= made.figure.bbox.x1
            assert beside
            assert inside


@pytest.mark.parametrize("name", FIGURES)
def test_the_same_figure_is_the_same_file(name: str, recording: Recording) -> None:
    first, second = (svg(figure(name, recording).figure) for _ in range(2))
    assert first == second
    assert b"<svg" in first


def test_error_and_drift_are_drawn_in_pixels(recording: Recording) -> None:
    error, drift = figure("error", recording).axes
    trace = recording.cameras["wrist"]
    np.testing.assert_array_equal(error.lines[0].get_ydata(), trace.error_px[:, 0])
    np.testing.assert_array_equal(drift.lines[3].get_ydata(), trace.drift_px[:, 3])


def test_paths_lie_in_an_image_with_v_downwards(recording: Recording) -> None:
    [axes] = figure("paths", recording).axes
    left, right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    assert left < -0.5 < 319.5 < right
    assert top < -0.5 < 239.5 < bottom


def test_joint_limits_are_at_one() -> None:
    arm = ArmInfo(("a", "b", "c"), [-1.0, 2.0, -np.inf], [3.0, 4.0, np.inf], [1.0, 1.0, 1.0])
    np.testing.assert_allclose(normalized(arm, arm.q_min)[:2], -1.0)
    np.testing.assert_allclose(normalized(arm, arm.q_max)[:2], 1.0)
    np.testing.assert_allclose(normalized(arm, np.array([1.0, 3.0, 9.0]))[:2], 0.0)
    assert np.isnan(normalized(arm, np.zeros(3))[2])


def test_a_joint_without_limits_is_drawn_in_half_turns(recording: Recording) -> None:
    info, trace = recording.info.arms["puma"], recording.arms["puma"]
    endless = ArmInfo(
        info.names,
        np.append(info.q_min[:5], -np.inf),
        np.append(info.q_max[:5], np.inf),
        info.rate_max,
    )
    q = trace.position.copy()
    q[:, 5] = np.deg2rad(np.linspace(27.0, 387.0, len(q)))
    made = joints_figure(endless, replace(trace, position=q))
    assert made is not None
    drawn = made.axes[0].lines[5]
    assert drawn.get_label() == "joint6 (half turns)"
    assert drawn.get_ydata()[0] == pytest.approx(27 / 180)
    assert drawn.get_ydata()[-1] == pytest.approx(27 / 180)
    assert np.abs(drawn.get_ydata()).max() <= 1.0
    np.testing.assert_array_equal(
        made.axes[0].lines[0].get_ydata(), drawn_positions(info, trace.position)[:, 0]
    )


def test_events_are_marked_in_every_panel(recording: Recording) -> None:
    made = figure("twist", recording)
    before = [len(axes.lines) for axes in made.axes]
    mark_events(made, recording.events)
    after = [len(axes.lines) for axes in made.axes]
    assert after == [count + len(recording.events) for count in before]
    assert [text.get_text() for text in made.axes[0].texts] == ["1", "2"]


def test_a_filters_error_is_its_distance_from_the_truth(recording: Recording) -> None:
    camera = recording.cameras["wrist"]
    poses = camera.T_world_target.copy()
    poses[:, :3, 3] += [0.003, 0.0, 0.004]
    poses[:, :3, :3] = se3_exp(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.1]))[:3, :3]
    count = len(camera.time)
    covariance = np.tile(1e-6 * np.eye(12), (count, 1, 1))
    sure = np.ones(count, dtype=bool)
    made = estimate_figure(
        camera,
        TargetTrace(camera.time, camera.received, poses, np.zeros((count, 6)), covariance, sure),
    )
    assert made is not None
    position, rotation = made.axes
    np.testing.assert_allclose(position.lines[0].get_ydata(), 5.0)
    np.testing.assert_allclose(position.lines[1].get_ydata(), np.sqrt(3.0))
    np.testing.assert_allclose(rotation.lines[0].get_ydata(), np.degrees(0.1))


def test_events_at_one_time_share_a_number(recording: Recording) -> None:
    made = figure("twist", recording)
    events = [Event(time, "lost", "") for time in (1.0, 1.01, 1.02, 4.0)]
    mark_events(made, events)
    assert [text.get_text() for text in made.axes[0].texts] == ["1–3", "4"]


def test_nothing_known_gives_no_figure(recording: Recording) -> None:
    camera, arm = recording.cameras["wrist"], recording.arms["puma"]
    unknown = np.full_like(camera.points_px, np.nan)
    blind = replace(
        camera,
        found=np.zeros_like(camera.found),
        desired_px=unknown,
        true_px=unknown,
        T_world_camera=np.full_like(camera.T_world_camera, np.nan),
    )
    still = replace(
        arm,
        v_camera=np.full_like(arm.v_camera, np.nan),
        manipulability=np.full_like(arm.manipulability, np.nan),
        penalty=np.full_like(arm.penalty, np.nan),
    )
    assert error_figure(blind) is None
    assert paths_figure(recording.info.cameras["wrist"], blind) is None
    assert camera_figure(blind) is None
    assert target_figure(replace(blind, T_world_target=blind.T_world_camera), None) is None
    assert twist_figure(still) is None
    assert measures_figure(still) is None


def test_many_features_are_summed_up(recording: Recording) -> None:
    camera = recording.cameras["wrist"]
    crowd = replace(
        camera,
        points_px=np.tile(camera.points_px, (1, 5, 1)),
        desired_px=np.tile(camera.desired_px, (1, 5, 1)),
        true_px=np.tile(camera.true_px, (1, 5, 1)),
        found=np.tile(camera.found, (1, 5)),
    )
    made = error_figure(crowd)
    assert made is not None
    assert [line.get_label() for line in made.axes[0].lines] == ["largest of 20", "median"]
