"""A target with a tag is found by the tag alone, followed by its corners, and never by another."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from vergence.assembly import assemble_parts, rehearse, run_driver
from vergence.assembly.copied import copied
from vergence.cell import Cell, load_cell
from vergence.errors import InputError
from vergence.runtime import Run
from vergence.signals import Outcome, OutcomeKind
from vergence.simulation import SimulatedDriver
from vergence.vision.marks import MarkerDetector, one_tag

AT_REST = {"kind": "stationary"}
FOLLOW = {"kind": "follow", "arm": "ur5", "camera": "wrist"}
BY_POSE = {"kind": "position_based"}
REACH = {"kind": "reach", "arm": "ur5", "camera": "wrist"}
GOAL_DEG = [2.0, -98.0, 98.0, -88.0, -88.0, 20.0]
ELSEWHERE = {"position_m": (0.9, 0.6, -0.3), "rotation_rpy_deg": (60.0, 10.0, 120.0)}


def tagged(target: Mapping[str, Any] | None = None, **tables: Any) -> Cell:
    cell = load_cell("tag").replace(target={"motion": AT_REST, **(target or {})}, duration_s=3.0)
    return cell.replace(**tables)


def run_believing(believed: Cell, true: Cell) -> Run:
    """Run a cell with a driver of another: as on a robot, whose cell file knows less."""
    driver = SimulatedDriver(true)
    try:
        return run_driver(believed, driver, (), images=True)
    finally:
        driver.close()


def parts_believing(believed: Cell, true: Cell) -> Any:
    driver = SimulatedDriver(true)
    try:
        return assemble_parts(believed, driver)
    finally:
        driver.close()


def test_a_rendered_tag_has_its_corners_where_the_truth_has_them() -> None:
    place = {"position_m": (0.01, -0.02, 0.03), "rotation_rpy_deg": (5.0, -8.0, 33.0)}
    tag = {"dictionary": "aruco_4x4_50", "id": 3, "size_m": 0.04, **place}
    driver = SimulatedDriver(tagged({"tag": tag}))
    try:
        frame = driver.first_frame("wrist")
    finally:
        driver.close()
    seen = MarkerDetector("aruco_4x4_50").detect(frame.image)
    assert seen.ids.tolist() == [3]
    np.testing.assert_allclose(seen.corners_px[0], frame.truth.points_px, atol=0.3)


def test_the_tag_is_tracked_without_being_told_where_it_is() -> None:
    run = run_believing(tagged(ELSEWHERE), tagged())
    assert run.outcome.succeeded, run.outcome.reason
    assert run.summary["final_error_px"] < 0.5
    assert run.summary["max_drift_px"] < 0.5


def test_its_pose_is_followed_without_being_told_where_it_is() -> None:
    desired = {"position_m": (0.0, 0.0, 0.25), "rotation_rpy_deg": (180.0, 0.0, -110.0)}
    task = {**FOLLOW, "desired": desired}
    run = run_believing(tagged(ELSEWHERE, task=task, law=BY_POSE), tagged())
    assert run.outcome.succeeded, run.outcome.reason
    assert run.summary["final_pose_error_m"] < 1e-3
    assert run.summary["final_pose_error_deg"] < 0.5


def test_a_goal_is_reached_where_its_image_shows_the_tag() -> None:
    true = tagged(task={**REACH, "goal_deg": GOAL_DEG})
    driver = SimulatedDriver(true)
    try:
        run = run_driver(true.replace(target=ELSEWHERE), driver, (), images=True)
        arm = driver.arms["ur5"]
        there = arm.forward_kinematics(np.deg2rad(GOAL_DEG))
        here = arm.forward_kinematics(driver.world.joint_position("ur5"))
    finally:
        driver.close()
    assert run.outcome.kind is OutcomeKind.REACHED, run.outcome.reason
    assert np.linalg.norm(here[:3, 3] - there[:3, 3]) < 2e-3


@pytest.mark.parametrize(
    ("tag", "words"),
    [
        ({"id": 8}, "marker 8 is not seen by camera wrist at the start; it shows marker 7 of"),
        ({"dictionary": "aruco_4x4_50"}, "it shows marker 7 of apriltag_36h11"),
    ],
)
@pytest.mark.parametrize("task", ["track", "follow"])
def test_another_tag_is_refused_by_what_is_seen(tag: dict[str, Any], words: str, task: str) -> None:
    given = {} if task == "track" else {"task": FOLLOW, "law": BY_POSE}
    with pytest.raises(InputError, match=r"target\.tag: .*") as refused:
        parts_believing(tagged({"tag": tag}, **given), tagged())
    assert words in str(refused.value)


def test_a_tag_that_is_seen_twice_is_neither_of_them() -> None:
    driver = SimulatedDriver(tagged())
    image = driver.first_frame("wrist").image
    driver.close()
    detector = MarkerDetector("apriltag_36h11")
    assert not isinstance(one_tag(detector, image, 7), str)
    assert one_tag(detector, np.hstack([image, image]), 7) == "marker 7 is seen 2 times"


def test_a_pose_that_one_image_leaves_open_begins_nothing() -> None:
    """Small and seen straight on: the tag may tilt either way."""
    place = {"rotation_rpy_deg": (4.0, 3.0, 20.0), "position_m": (0.45, 0.11, 0.14)}
    small = {**place, "tag": {"size_m": 0.008}}
    started = parts_believing(tagged(small, task=FOLLOW, law=BY_POSE), tagged(small))
    assert isinstance(started, Outcome)
    assert started.kind is OutcomeKind.TARGET_LOST
    assert "two different poses explain the points" in started.reason


@pytest.mark.parametrize(
    ("setting", "key", "allowed"),
    [
        ({"target.tag.id": "600"}, "target.tag.id", "0 to 586 in apriltag_36h11"),
        ({"target.tag.id": ""}, "target.tag.id", "a value"),
        ({"target.tag.size_m": ""}, "target.tag.size_m", "a value"),
        ({"target.tag.size_m": "0.0"}, "target.tag.size_m", "at least 0.001"),
        ({"target.tag.dictionary": "april"}, "target.tag.dictionary", "apriltag_36h11"),
        ({"target.tag.dictionary": "tagStandard41h12"}, "target.tag.dictionary", "apriltag_36h11"),
        ({"target.tag.dictionary": "tagCircle21h7"}, "target.tag.dictionary", "apriltag_36h11"),
        ({"target.tag.dictionary": "tag36h11"}, "target.tag.dictionary", "apriltag_36h11"),
        ({"target.tag": ""}, "target.model", "a value, or a tag"),
        ({"target.features": "[[0, 0, 0]]"}, "target.features", "target.tag alone"),
        (
            {"task.tracker": "{ kind = 'tags', dictionary = 'aruco_4x4_50' }"},
            "task.tracker.dictionary",
            "target.tag.dictionary alone",
        ),
    ],
)
def test_what_cannot_be_a_tag_is_refused_by_key(
    setting: dict[str, str], key: str, allowed: str
) -> None:
    with pytest.raises(InputError) as refused:
        load_cell("tag", setting)
    assert refused.value.key == key
    assert allowed in refused.value.allowed


def test_a_reach_refuses_keys_that_a_tag_makes_useless() -> None:
    cell = tagged(task={**REACH, "goal_deg": GOAL_DEG, "distance_m": 0.3})
    with pytest.raises(InputError, match="the tag determines pose and scale"):
        parts_believing(cell, cell)


def test_what_follows_a_tag_can_be_copied_so_that_it_is_warmed_up_before_the_arm_moves() -> None:
    for given in ({}, {"task": FOLLOW, "law": BY_POSE}):
        parts = parts_believing(tagged(**given), tagged())
        copied(parts.perception)


@pytest.mark.parametrize("given", [{}, {"task": FOLLOW, "law": BY_POSE}])
def test_a_run_on_a_robot_is_rehearsed_without_knowing_where_the_tag_is(
    given: dict[str, Any],
) -> None:
    behind = {"position_m": (-1.0, 0.0, 1.5)}
    tag = {"position_m": (0.1, 0.0, 0.02), "rotation_rpy_deg": (0.0, 90.0, 0.0)}
    rehearse(tagged({**behind, "tag": tag}, **given), duration_s=0.1)


def test_a_tool_beside_a_tag_is_refused() -> None:
    tag = {"target.tag": "{ id = 3, size_m = 0.05 }", "target.features": ""}
    with pytest.raises(InputError, match="one tracker measures both"):
        load_cell("wrist_and_wall", tag)
