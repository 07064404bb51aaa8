"""How a run is judged at its end: at its goal, or at rest before it, and what holds it there."""

import numpy as np

import vergence as vg
from vergence.arrays import FloatArray
from vergence.runtime.arrival import Arrival, Goal
from vergence.signals import ImagePoints, JointCommand, Observation, OutcomeKind, Reference

SQUARE = np.array([[100.0, 100.0], [200.0, 100.0], [200.0, 200.0], [100.0, 200.0]])


def arrival(
    points_px: FloatArray,
    *,
    goal: Goal | None = None,
    speed: float = 0.0,
    active: tuple[str, ...] = (),
    noise_px: float = 0.0,
    rate_max: float = 1.0,
) -> Arrival:
    """Return what has seen two seconds of points with the square desired."""
    watched = Arrival(goal or Goal(), np.full(6, rate_max))
    random = np.random.default_rng(0)
    for k in range(60):
        measured = points_px + noise_px * random.standard_normal(points_px.shape)
        found = np.ones(len(measured), dtype=np.bool_)
        covariance = np.tile(np.eye(2), (len(measured), 1, 1))
        view = ImagePoints("c", k / 30, measured, covariance, found, ("",) * len(measured))
        command = JointCommand(np.zeros(6), np.zeros(6), active=active)
        q = np.full(6, speed * k / 30)
        watched.observe(Observation(k / 30, (view,)), Reference(k / 30, SQUARE), command, q)
    return watched


def test_a_task_with_an_end_is_reached_at_its_goal() -> None:
    outcome = arrival(SQUARE + 0.3, goal=Goal(1.0, ends=True)).outcome(2.0, 2.0)
    assert outcome.kind is OutcomeKind.REACHED
    assert outcome.succeeded


def test_noise_about_the_goal_is_no_stall() -> None:
    assert not arrival(SQUARE, noise_px=2.0).stalled


def test_an_arm_that_nears_its_goal_slowly_has_not_stalled() -> None:
    for rate, stalled in ((1.0, False), (0.0, True)):
        watched = Arrival(Goal(), np.ones(6))
        for k in range(60):
            measured = SQUARE + 6.0 * np.exp(-rate * k / 30)
            found, covariance = np.ones(4, dtype=np.bool_), np.tile(np.eye(2), (4, 1, 1))
            view = ImagePoints("c", k / 30, measured, covariance, found, ("",) * 4)
            q = np.full(6, 1e-4 * np.exp(-rate * k / 30))  # less than rest allows in any second
            command = JointCommand(np.zeros(6), np.zeros(6))
            watched.observe(Observation(k / 30, (view,)), Reference(k / 30, SQUARE), command, q)
        assert watched.stalled is stalled


def test_an_arm_whose_target_sets_off_has_stalled_only_where_a_limit_holds_it() -> None:
    for active, stalled in (((), False), (("joint positions",), True)):
        watched = Arrival(Goal(), np.ones(6))
        for k in range(45):
            measured = SQUARE + 10.0 * max(k / 30 - 1.0, 0.0)
            view = ImagePoints(
                "c", k / 30, measured, np.tile(np.eye(2), (4, 1, 1)), np.ones(4, bool), ("",) * 4
            )
            command = JointCommand(np.zeros(6), np.zeros(6), active=active)
            reference = Reference(k / 30, SQUARE)
            watched.observe(Observation(k / 30, (view,)), reference, command, np.zeros(6))
        assert watched.error_px > 1.0
        assert watched.stalled is stalled


def test_a_task_with_an_end_that_moves_when_its_time_is_over_is_not_reached() -> None:
    outcome = arrival(SQUARE + 5.0, goal=Goal(1.0, ends=True), speed=0.1).outcome(2.0, 2.0)
    assert outcome.kind is OutcomeKind.NOT_REACHED
    assert "7.07 px" in outcome.reason
    assert "time" in outcome.reason


def test_a_task_without_an_end_that_lags_behind_its_target_is_completed() -> None:
    assert arrival(SQUARE + 5.0, speed=0.1).outcome(2.0, 2.0).kind is OutcomeKind.COMPLETED


def test_an_arm_whose_model_has_no_real_rate_limits_is_not_taken_for_resting_while_it_moves() -> (
    None
):
    for rate_max in (100.0, np.inf):
        watched = arrival(SQUARE + 5.0, speed=0.05, rate_max=rate_max)
        assert watched.outcome(2.0, 2.0).kind is OutcomeKind.COMPLETED
        assert arrival(SQUARE + 5.0, rate_max=rate_max).stalled


def test_a_stall_names_the_limits_that_hold_the_arm() -> None:
    outcome = arrival(SQUARE + 5.0, active=("view", "singularity")).outcome(2.0, 2.0)
    assert outcome.kind is OutcomeKind.NOT_REACHED
    assert "held by view and singularity" in outcome.reason


def test_a_stall_under_no_limit_is_a_local_minimum() -> None:
    assert "local minimum" in arrival(SQUARE + 5.0).outcome(2.0, 2.0).reason


def test_a_stall_before_the_mirror_image_of_its_goal_says_so() -> None:
    assert "mirror image" in arrival(SQUARE[[1, 0, 3, 2]]).outcome(2.0, 2.0).reason


def test_a_turned_goal_is_not_taken_for_a_mirror_image() -> None:
    assert "mirror image" not in arrival(SQUARE[[2, 3, 0, 1]]).outcome(2.0, 2.0).reason


def test_what_another_camera_sees_is_not_held_against_the_goal_of_the_tasks_camera() -> None:
    watched = Arrival(Goal(), np.ones(6))
    command = JointCommand(np.zeros(6), np.zeros(6))
    for k in range(60):
        found, covariance = np.ones(4, dtype=np.bool_), np.tile(np.eye(2), (4, 1, 1))
        views = tuple(
            ImagePoints(name, k / 30, points, covariance, found, ("",) * 4)
            for name, points in (("c", SQUARE), ("wall", SQUARE + 50.0))
        )
        reference = Reference(k / 30, SQUARE, elsewhere_px={"wall": SQUARE})
        watched.observe(Observation(k / 30, views), reference, command, np.zeros(6))
    assert watched.error_px == 0.0


def test_a_goal_inside_the_view_margin_ends_a_run_as_not_reached() -> None:
    still = {"motion": "stationary"}
    start = vg.run("ur5", images=False, duration_s=0.2, target=still)
    name = start.info.task_camera
    desired = start.cameras[name].points_px[0]
    beyond = desired + [start.info.cameras[name].width - 5.0 - desired[:, 0].max(), 0.0]
    changes = {"target": still, "task": {"desired": beyond.tolist()}}
    run = vg.run("ur5", images=False, duration_s=6.0, **changes)
    assert run.outcome.kind is OutcomeKind.NOT_REACHED
    assert "view" in run.outcome.reason
