"""What does not show in an image stays as predicted, and everything else is taken from it."""

from dataclasses import replace

import numpy as np
import pytest

from vergence.estimation import (
    Belief,
    PoseFilter,
    shown_covariance,
    told_covariance,
    with_turn,
    with_undecided,
    with_unknown,
    with_unseen,
    without_unseen,
)
from vergence.estimation.filters.unseen_turns import MOST_RAD, UNKNOWN_RAD
from vergence.geometry import pose_difference, se3, so3_exp


def turning(rng: np.random.Generator) -> tuple[Belief, np.ndarray]:
    """A belief, and the motion of a turn about an axis beside the origin."""
    T = se3(so3_exp(rng.normal(0.0, 1.0, 3)), rng.normal(0.0, 0.3, 3))
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    half = rng.normal(0.0, 0.05, (12, 12))
    belief = PoseFilter().start(0.0, T, covariance=half @ half.T + 1e-6 * np.eye(12))
    motion = np.concatenate((np.cross(axis, rng.normal(0.0, 0.1, 3)), axis))
    return belief, motion[:, None]


def test_a_turn_that_does_not_show_is_not_corrected_and_the_rest_is() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        belief, motions = turning(rng)
        step = rng.normal(0.0, 0.002, 6)
        T = belief.T_world_target
        moved = se3(so3_exp(step[3:].copy()) @ T[:3, :3], T[:3, 3] + step[:3])
        updated = replace(without_unseen(belief, motions), T_world_target=moved)
        after = with_unseen(belief, updated, motions)
        change = pose_difference(after.T_world_target, T)
        expected = step - motions[:, 0] * (motions[3:, 0] @ step[3:])
        assert change == pytest.approx(expected, abs=2e-5)


def test_its_variance_is_that_of_the_prediction_up_to_a_bound_and_told_as_unknown_there() -> None:
    rng = np.random.default_rng(1)
    belief, motions = turning(rng)
    axis, none = motions[3:, 0], np.zeros((6, 6))
    for size in (0.1, 10.0):
        known = replace(belief, covariance=size * belief.covariance)
        predicted = axis @ known.covariance[3:6, 3:6] @ axis
        after = with_unseen(known, without_unseen(known, motions), motions)
        assert axis @ after.covariance[3:6, 3:6] @ axis == pytest.approx(
            min(predicted, MOST_RAD**2)
        )
        told = told_covariance(after, motions, none, none)
        expected = predicted if predicted < MOST_RAD**2 else UNKNOWN_RAD**2
        assert axis @ told[3:6, 3:6] @ axis == pytest.approx(expected)
        shown = shown_covariance(after, motions)
        assert axis @ shown[3:6, 3:6] @ axis < 1e-6
        np.linalg.cholesky(shown[:6, :6])


def test_without_such_motions_a_belief_stays_what_it_is() -> None:
    belief, _ = turning(np.random.default_rng(2))
    none = np.zeros((6, 0))
    assert without_unseen(belief, none) is belief
    assert with_unseen(belief, belief, none) is belief


def test_a_turn_that_is_not_decided_stays_as_uncertain_as_it_was_up_to_the_farthest_one() -> None:
    rng = np.random.default_rng(2)
    belief, motions = turning(rng)
    axis = motions[3:, 0]
    updated = replace(belief, covariance=1e-4 * belief.covariance)
    predicted = axis @ belief.covariance[3:6, 3:6] @ axis
    for angle in (0.5 * np.sqrt(predicted), 2.0 * np.sqrt(predicted)):
        after = with_undecided(belief, updated, angle * motions)
        assert axis @ after.covariance[3:6, 3:6] @ axis == pytest.approx(min(predicted, angle**2))
    assert with_undecided(belief, updated, np.zeros((6, 0))) is updated


def test_after_a_jump_to_another_turn_the_velocity_about_its_axis_is_not_known() -> None:
    rng = np.random.default_rng(3)
    belief, motions = turning(rng)
    belief = replace(belief, velocity=rng.normal(size=6))
    motion, axis = 0.4 * motions[:, 0], motions[3:, 0]
    after = with_turn(belief, motion)
    moved = pose_difference(after.T_world_target, belief.T_world_target)
    assert moved == pytest.approx(motion)
    assert axis @ after.velocity[3:] == pytest.approx(0.0, abs=1e-12)
    assert axis @ after.covariance[9:, 9:] @ axis > 9.0


def test_a_pose_that_fits_far_along_a_turn_is_covered_though_it_lies_beside_its_line() -> None:
    rng = np.random.default_rng(4)
    belief, motions = turning(rng)
    beside = np.concatenate((rng.normal(0.0, 0.02, 3), np.cross(motions[3:, 0], (0.1, 0.2, 0.3))))
    far = 2.0 * motions + beside[:, None]
    unknown = replace(belief, covariance=with_unknown(1e-8 * np.eye(12), motions))
    none = np.zeros((6, 6))
    for astray, least, most in ((none, 1e5, np.inf), (far @ far.T, 0.0, 4.0 + 1.0)):
        P = told_covariance(unknown, motions, none, astray)[:6, :6]
        assert least < far[:, 0] @ np.linalg.solve(P, far[:, 0]) < most
