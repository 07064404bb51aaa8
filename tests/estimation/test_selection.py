from itertools import combinations

import numpy as np
import pytest
from estimation_scene import BOX, CAMERA, HAND, WALL, moving, pose_error, view

from vergence.camera import Camera
from vergence.errors import InputError
from vergence.estimation import (
    Candidates,
    IndexSelection,
    InformationSelection,
    PoseFilter,
    RpyPoseFilter,
)
from vergence.estimation.index_selection import (
    angular_index,
    exchange,
    spatial_index,
    spread_quality,
)
from vergence.estimation.selection import absorb, candidate_rows, greedy_information, innovation
from vergence.estimation.windows import WindowRule, innovation_spread
from vergence.geometry import se3_inverse, transform_points


def random_problem(rng, count):
    rows = rng.standard_normal((count, 2, 6)) * rng.uniform(0.1, 3.0, (count, 1, 1))
    A = rng.standard_normal((6, 6))
    return rows, A @ A.T


def plain_greedy(rows, weights, P, budget):
    """The twin: every candidate looked at in every round, with full matrices."""
    information, chosen = np.linalg.inv(P), []
    for _ in range(min(budget, len(rows))):
        values = [
            -np.inf
            if n in chosen
            else np.log(weights[n])
            + np.linalg.slogdet(np.eye(2) + H @ np.linalg.inv(information) @ H.T)[1]
            for n, H in enumerate(rows)
        ]
        chosen.append(int(np.argmax(values)))
        information = information + rows[chosen[-1]].T @ rows[chosen[-1]]
    return chosen


def candidates(T_cameras, T=None, held=None, covariance=None, visible=None):
    T = np.eye(4) if T is None else T
    count = len(T_cameras)
    inverse = np.array([se3_inverse(pose) for pose in T_cameras])
    places = np.array([CAMERA.project(transform_points(C @ T, BOX)) for C in inverse])
    return Candidates(
        np.ones((count, len(BOX)), bool) if visible is None else visible,
        places,
        BOX,
        np.tile(T, (count, 1, 1)),
        inverse,
        np.full((count, 2), 1.0 / CAMERA.fx),
        np.full(count, np.hypot(CAMERA.width, CAMERA.height)),
        np.diag([1e-4] * 3 + [1e-2] * 3) if covariance is None else covariance,
        np.zeros((count, len(BOX)), bool) if held is None else held,
    )


@pytest.mark.parametrize("seed", range(8))
def test_greedy_choice_is_that_of_full_matrices(seed):
    rng = np.random.default_rng(seed)
    rows, P = random_problem(rng, 30)
    weights = np.where(rng.random(30) < 0.3, 1.5, 1.0)
    assert list(greedy_information(rows, weights, P, 7)) == plain_greedy(rows, weights, P, 7)


def test_greedy_choice_is_near_the_best_of_all_subsets():
    # Submodular and monotone: never below 1 - 1/e of the optimum found by trying everything.
    for seed in range(5):
        rng = np.random.default_rng(seed)
        rows, P = random_problem(rng, 9)

        def gain(chosen, rows=rows, P=P):
            H = rows[list(chosen)].reshape(-1, 6)
            return 0.5 * np.linalg.slogdet(np.eye(len(H)) + H @ P @ H.T)[1]

        best = max(gain(subset) for subset in combinations(range(9), 3))
        greedy = gain(greedy_information(rows, np.ones(9), P, 3))
        assert (1 - 1 / np.e) * best <= greedy <= best + 1e-12


def test_innovation_is_the_covariance_of_two_whitened_rows():
    rows, P = random_problem(np.random.default_rng(1), 1)
    expected = np.eye(2) + rows[0] @ P @ rows[0].T
    np.testing.assert_allclose(innovation(rows[0], P), expected[[0, 0, 1], [0, 1, 1]])


def test_absorbed_rows_leave_what_information_adds_to_the_inverse_covariance():
    rows, P = random_problem(np.random.default_rng(2), 5)
    S = np.array([innovation(H, P) for H in rows])
    after = np.linalg.inv(np.linalg.inv(P) + rows[3].T @ rows[3])
    for row in rows[3]:
        absorb(row, P, rows, S)
    np.testing.assert_allclose(P, after, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(S, [innovation(H, after) for H in rows], rtol=1e-9)


def test_candidate_rows_are_those_of_the_visible_features():
    visible = np.zeros((2, len(BOX)), bool)
    visible[0, 3] = visible[1, 5] = True
    given = candidates([WALL, HAND], visible=visible)
    rows, numbers = candidate_rows(
        given.T_world_target, given.T_camera_world, BOX, given.noise, visible
    )
    np.testing.assert_array_equal(numbers, [3, len(BOX) + 5])
    assert rows.shape == (2, 2, 6)


@pytest.mark.parametrize("selection", [InformationSelection(), IndexSelection()])
@pytest.mark.parametrize("budget", [0, 1, 4, 50])
def test_budget_and_visibility_are_kept(selection, budget):
    rng = np.random.default_rng(2)
    visible = rng.random((2, len(BOX))) < 0.6
    chosen = selection.choose(candidates([WALL, HAND], visible=visible), budget)
    assert chosen.sum() == min(budget, visible.sum())
    assert not (chosen & ~visible).any()


def test_nothing_visible_gives_nothing_chosen():
    none = candidates([WALL], visible=np.zeros((1, len(BOX)), bool))
    assert not InformationSelection().choose(none, 4).any()
    assert not IndexSelection().choose(none, 4).any()


@pytest.mark.parametrize("selection", [InformationSelection(), IndexSelection()])
def test_chosen_set_does_not_flicker(selection):
    rng = np.random.default_rng(3)
    held, changes = None, 0
    for k in range(60):
        T = moving(0.3 + 0.002 * k)
        T[:3, 3] += 2e-4 * rng.standard_normal(3)
        chosen = selection.choose(candidates([WALL, HAND], T, held), 6)
        changes += 0 if held is None else int((chosen & ~held).sum())
        held = chosen
    assert changes <= 3


def test_information_asks_the_camera_that_sees_what_is_unsure():
    # Unsure along the wall camera's line of sight only: the hand camera can tell, the wall cannot.
    sight = WALL[:3, 2]
    covariance = 1e-10 * np.eye(6)
    covariance[:3, :3] += 1e-2 * np.outer(sight, sight)
    chosen = InformationSelection().choose(candidates([WALL, HAND], covariance=covariance), 1)
    assert chosen[1].sum() == 1


def test_indexes_of_a_regular_polygon_are_its_side_and_one():
    angles = 2 * np.pi * np.arange(6) / 6
    hexagon = np.column_stack((np.cos(angles), np.sin(angles)))
    assert spatial_index(hexagon) == pytest.approx(1.0)
    assert angular_index(hexagon) == pytest.approx(1.0)
    assert angular_index(hexagon @ np.diag([1.0, 0.1])) < 0.7
    assert spatial_index(hexagon[:1]) == angular_index(hexagon[:1]) == 1.0


def test_exchange_reaches_a_spread_that_no_swap_improves():
    rng = np.random.default_rng(4)
    places, cameras = rng.random((10, 2)), np.repeat([0, 1], 5)
    chosen = exchange(places, cameras, np.array([0, 1, 2]), 0.0, 100)
    quality = spread_quality(places, cameras, chosen)
    for k in range(3):
        for n in set(range(10)) - set(chosen):
            other = chosen.copy()
            other[k] = n
            assert spread_quality(places, cameras, other) <= quality + 1e-12


def test_four_features_chosen_by_information_hold_a_moving_target():
    rng = np.random.default_rng(5)
    filter_, selection, held = PoseFilter(), InformationSelection(), None
    belief = filter_.start(0.0, moving(0.0))
    for k in range(1, 200):
        time = k / 26
        predicted = filter_.predict(belief, time)
        given = candidates(
            [WALL, HAND], predicted.T_world_target, held, predicted.covariance[:6, :6]
        )
        held = selection.choose(given, 4)
        for c, (name, pose) in enumerate((("wall", WALL), ("hand", HAND))):
            image = view(rng, time, moving(time), pose, name, 1.0, features=np.flatnonzero(held[c]))
            belief = filter_.update(belief, image).belief
        if time > 1.0:
            error = pose_error(belief.T_world_target, moving(time))
            assert np.linalg.norm(error[:3]) < 0.006
            assert np.degrees(np.linalg.norm(error[3:])) < 5.0


def test_settings_that_make_no_sense_are_refused():
    with pytest.raises(InputError, match="hold"):
        InformationSelection(hold=0.9)
    with pytest.raises(InputError, match="margin"):
        IndexSelection(margin=-1.0)
    with pytest.raises(InputError, match="least_px"):
        WindowRule(least_px=200.0)


def test_windows_hold_the_feature_as_often_as_they_promise():
    rng = np.random.default_rng(6)
    A = np.diag([0.004] * 3 + [0.02] * 3)
    P, rule = A @ A.T, WindowRule(deviations=3.0, border_px=0.0, least_px=1.0)
    T, C = moving(0.4), se3_inverse(HAND)
    half = rule.half_sizes(innovation_spread(T, C, BOX, P), CAMERA.focal_px, 1.0)
    from vergence.geometry import moved_pose

    places = CAMERA.project(transform_points(C @ T, BOX))
    inside = total = 0
    for _ in range(500):
        moved = moved_pose(T, np.concatenate((A @ rng.standard_normal(6), np.zeros(6))))
        seen = CAMERA.project(transform_points(C @ moved, BOX)) + rng.standard_normal((len(BOX), 2))
        inside += (np.abs(seen - places) <= half).sum()
        total += half.size
    assert 0.99 < inside / total <= 1.0


def test_windows_stay_within_their_bounds_and_widen_in_doubt():
    rule = WindowRule(least_px=8.0, most_px=40.0)
    focal = np.array([1000.0, 1000.0])
    spread = np.array([[0.0, 1e-3], [1e-2, 1.0]])
    half = rule.half_sizes(spread, focal, 0.25)
    assert half.min() == 8.0
    assert half.max() == 40.0
    assert (rule.half_sizes(spread, focal, 0.25, 2.0) >= half).all()


def test_other_cameras_need_not_share_a_resolution():
    small = Camera(320, 240, 300.0, 300.0, 159.5, 119.5)
    given = candidates([WALL, HAND])._replace(noise=np.array([[1 / 964] * 2, [1 / small.fx] * 2]))
    assert InformationSelection().choose(given, 3)[0].sum() >= 1


def test_rpy_filter_may_drive_the_selection_too():
    belief = RpyPoseFilter().start(0.0, moving(0.0))
    given = candidates([WALL], moving(0.0), covariance=belief.covariance[:6, :6].copy())
    assert InformationSelection().choose(given, 4).sum() == 4
