from dataclasses import replace

import numpy as np
import pytest
from estimation_scene import BOX, HAND, WALL, moving, pose_error, view

from vergence.errors import InputError
from vergence.estimation import PoseFilter, Verdict
from vergence.estimation.filters.target_filter import state_of
from vergence.estimation.view import together
from vergence.geometry import moved_pose

SMALL_START = np.diag(np.repeat([0.01, 0.03, 0.05, 0.1], 3) ** 2)


def track(filter_, rng, seconds, rate=26.0, speed=1.0, belief=None, until=None, **kwargs):
    """Follow the smooth motion with wall and hand camera; yield (time, belief, updates)."""
    belief = belief or filter_.start(0.0, moving(0.0, speed))
    for k in range(1, int(seconds * rate) + 1):
        time = k / rate
        updates = []
        for name, pose in (("wall", WALL), ("hand", HAND)):
            updates.append(
                filter_.update(
                    belief, view(rng, time, moving(time, speed), pose, camera=name, **kwargs)
                )
            )
            belief = updates[-1].belief
        yield time, belief, updates


def errors(belief, speed=1.0):
    error = pose_error(belief.T_world_target, moving(belief.time, speed))
    return np.linalg.norm(error[:3]), np.degrees(np.linalg.norm(error[3:]))


def test_target_that_moves_as_modelled_is_estimated_with_an_honest_covariance():
    # Monte Carlo: the truth is driven by the very noise the filter assumes. NEES / 12 and NIS / dof
    # must have mean one; bounds are five standard deviations of the means.
    rng = np.random.default_rng(42)
    filter_ = PoseFilter(acceleration_density=0.05, angular_acceleration_density=0.5)
    dt, runs, steps = 1.0 / 26.0, 60, 25
    root = np.sqrt([0.05, 0.5]).repeat(3)
    nees, ratios, pose_nees = [], [], []
    for _ in range(runs):
        start = np.linalg.cholesky(SMALL_START) @ rng.standard_normal(12)
        estimate, velocity = moving(0.0), np.zeros(6)
        truth, velocity = moved_pose(estimate, start), velocity + start[6:]
        belief = filter_.start(0.0, estimate, covariance=SMALL_START)
        for k in range(1, steps + 1):
            a, b = rng.standard_normal((2, 6))
            change = root * np.sqrt(dt) * a
            shift = root * dt**1.5 * (a / 2 + b / np.sqrt(12))
            truth = moved_pose(moved_pose(truth, dt * velocity), shift)
            velocity = velocity + change
            pose = WALL if k % 2 else HAND
            belief = filter_.update(belief, view(rng, k * dt, truth, pose)).belief
        error = np.concatenate(
            (pose_error(belief.T_world_target, truth), velocity - belief.velocity)
        )
        nees.append(error @ np.linalg.solve(belief.covariance, error))
        pose_nees.append(error[:6] @ np.linalg.solve(belief.covariance[:6, :6], error[:6]))
        ratios.append(belief.consistency.ratio)
    assert abs(np.mean(nees) / 12 - 1) < 5 * np.sqrt(2 / (12 * runs))
    assert abs(np.mean(pose_nees) / 6 - 1) < 5 * np.sqrt(2 / (6 * runs))
    assert abs(np.mean(ratios) - 1) < 5 * np.sqrt(2 / (10 * 16 * runs))


def test_smooth_motion_is_followed_within_millimetres():
    rng = np.random.default_rng(1)
    for time, belief, _ in track(PoseFilter(), rng, 6.0):
        if time > 0.5:
            position, degrees = errors(belief)
            assert position < 0.003
            assert degrees < 1.5
            assert belief.consistency.holds


def test_one_fifth_wrong_matches_do_no_harm():
    rng = np.random.default_rng(2)
    rejected = 0
    for time, belief, updates in track(PoseFilter(), rng, 10.0, outliers=0.2):
        rejected += sum(np.count_nonzero(~update.kept) for update in updates)
        if time > 0.5:
            assert errors(belief)[0] < 0.005
    assert rejected > 0.1 * 10 * 26 * 2 * len(BOX)


def test_bad_start_is_overruled_by_the_images():
    rng = np.random.default_rng(3)
    filter_ = PoseFilter()
    wrong = moved_pose(moving(0.0), np.array([0.1, -0.1, 0.05, 0.2, 0.3, -0.2] + 6 * [0.0]))
    start = filter_.start(0.0, wrong, covariance=1e-6 * np.eye(12))
    verdicts = []
    *steps, (_, belief, _) = track(filter_, rng, 2.0, belief=start)
    for _, _, updates in steps:
        verdicts += [update.verdict for update in updates]
    assert Verdict.RECOVERED in verdicts
    assert verdicts[-1] is Verdict.USED
    assert errors(belief)[0] < 0.003


def test_blackout_ends_in_recovery_and_the_covariance_covers_it():
    rng = np.random.default_rng(4)
    filter_ = PoseFilter()
    *_, (_, belief, _) = track(filter_, rng, 3.0)
    assert errors(belief)[0] < 0.003
    dark = filter_.predict(belief, 3.5)
    error = pose_error(dark.T_world_target, moving(3.5))
    assert error @ np.linalg.solve(dark.covariance[:6, :6], error) < 22.5  # χ²(6), one in 1000
    after = dark
    for k in range(1, 14):
        time = 3.5 + k / 26
        after = filter_.update(after, view(rng, time, moving(time), HAND)).belief
    assert errors(after)[0] < 0.004


def test_sudden_motion_is_noticed_and_caught_up_with():
    rng = np.random.default_rng(5)
    filter_ = PoseFilter(acceleration_density=1e-4, angular_acceleration_density=1e-4)
    belief = filter_.start(0.0, np.eye(4), covariance=1e-6 * np.eye(12))
    noticed = False
    for k in range(1, 60):
        time = k / 26
        T = np.eye(4)
        T[0, 3] = 0.0 if time < 0.7 else 0.5 * (time - 0.7)
        belief = filter_.update(belief, view(rng, time, T)).belief
        noticed = noticed or not state_of(belief).consistent
    assert noticed
    assert np.linalg.norm(belief.T_world_target[:3, 3] - T[:3, 3]) < 0.003
    assert belief.velocity[0] == pytest.approx(0.5, abs=0.05)


def test_image_of_another_thing_is_refused_and_doubted():
    rng = np.random.default_rng(6)
    filter_ = PoseFilter()
    *_, (time, belief, _) = track(filter_, rng, 1.0)
    image = view(rng, time + 0.04, moving(time))
    scrambled = image._replace(measured=rng.uniform(-0.3, 0.3, image.measured.shape))
    update = filter_.update(belief, scrambled)
    assert update.verdict is Verdict.CONTRADICTED
    assert not update.kept.any()
    assert update.belief.doubts == 1
    again = filter_.update(update.belief, scrambled._replace(time=time + 0.08))
    assert not state_of(again.belief).consistent
    np.testing.assert_array_equal(
        update.belief.T_world_target, filter_.predict(belief, time + 0.04).T_world_target
    )


def test_points_that_are_not_a_number_never_reach_the_pose():
    rng = np.random.default_rng(7)
    filter_ = PoseFilter()
    *_, (time, belief, _) = track(filter_, rng, 0.5)
    image = view(rng, time + 0.04, moving(time + 0.04))
    image.measured[2] = np.nan
    update = filter_.update(belief, image)
    assert not update.kept[2]
    assert np.isfinite(update.belief.T_world_target).all()
    assert np.isfinite(update.belief.covariance).all()


def test_uncertainty_falls_with_every_image_and_grows_between_them():
    rng = np.random.default_rng(8)
    filter_ = PoseFilter()
    belief = filter_.start(0.0, moving(0.0))
    predicted = filter_.predict(belief, 0.1)
    assert (np.linalg.eigvalsh(predicted.covariance - belief.covariance) > -1e-12).any()
    updated = filter_.update(belief, view(rng, 0.1, moving(0.1))).belief
    assert np.linalg.eigvalsh(predicted.covariance - updated.covariance)[0] > -1e-12


def test_second_camera_halves_the_error_along_the_first_ones_sight():
    rng = np.random.default_rng(9)
    filter_ = PoseFilter()
    alone = both = filter_.start(0.0, moving(0.0))
    for k in range(1, 30):
        time = k / 26
        image = view(rng, time, moving(time))
        alone = filter_.update(alone, image).belief
        both = filter_.update(
            filter_.update(both, image).belief, view(rng, time, moving(time), HAND, "hand")
        ).belief
    sight = WALL[:3, 2]
    spread = [np.sqrt(sight @ b.covariance[:3, :3] @ sight) for b in (alone, both)]
    assert spread[1] < 0.5 * spread[0]


@pytest.mark.parametrize(
    "covariance",
    [np.full((12, 12), np.nan), -np.eye(12), np.triu(np.ones((12, 12)))],
    ids=["not a number", "negative", "not symmetric"],
)
def test_start_refuses_what_is_no_covariance(covariance):
    with pytest.raises(InputError, match="covariance"):
        PoseFilter().start(0.0, np.eye(4), covariance=covariance)


def test_paper_start_without_uncertainty_trusts_the_first_pose():
    rng = np.random.default_rng(10)
    filter_ = PoseFilter()
    certain = filter_.start(0.0, np.eye(4), covariance=np.zeros((12, 12)))
    update = filter_.update(certain, view(rng, 0.0, np.eye(4)))
    np.testing.assert_allclose(update.belief.T_world_target, np.eye(4), atol=1e-15)
    assert replace(update.belief, time=0.0).covariance.max() == 0.0


def test_cameras_taken_together_agree_with_one_after_the_other():
    # The same information; only the point of linearisation differs.
    rng = np.random.default_rng(11)
    filter_ = PoseFilter()
    start = filter_.start(0.0, moving(0.0), covariance=0.01 * SMALL_START)
    views = [view(rng, 0.0, moving(0.0), pose) for pose in (WALL, HAND)]
    joint = filter_.update(start, together(views)).belief
    turns = filter_.update(filter_.update(start, views[0]).belief, views[1]).belief
    difference = pose_error(joint.T_world_target, turns.T_world_target)
    spread = np.sqrt(np.diag(joint.covariance)[:6])
    assert (np.abs(difference) < 0.02 * spread).all()
    np.testing.assert_allclose(np.diag(joint.covariance), np.diag(turns.covariance), rtol=1e-2)
