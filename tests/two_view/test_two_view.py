"""The reconstruction of an unknown object from two images."""

from dataclasses import replace

import numpy as np
import pytest
from certainty import count_answers, deviations
from scipy import stats
from two_view_scenes import CAMERA, Pair, pair, pose_facing, shape

from vergence.arrays import FloatArray
from vergence.errors import InputError, ShapeError
from vergence.geometry import se3, se3_inverse, so3_exp, so3_log, transform_points
from vergence.geometry.chi_square import normal_deviate_of_ratio
from vergence.studies.honesty.two_views import KINDS, try_scene
from vergence.vision.two_view import TwoView, TwoViewFailure, TwoViewProblem, estimate_two_view


def estimate(current: FloatArray, desired: FloatArray, **options: object) -> TwoView:
    result = estimate_two_view(current, desired, CAMERA, **options)  # type: ignore[arg-type]
    assert isinstance(result, TwoView), str(result)
    return result


def refusal(current: FloatArray, desired: FloatArray) -> TwoViewFailure:
    result = estimate_two_view(current, desired, CAMERA)
    assert isinstance(result, TwoViewFailure)
    assert not result
    return result


def distance_of(view: TwoView, points_star: FloatArray) -> float:
    """Return the true d* of the plane that the estimate chose."""
    return float(np.nanmedian(points_star[:, 2] / view.rho_star))


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("seed", range(10))
def test_exact_matches_give_the_exact_motion_and_shape(flat: bool, seed: int) -> None:
    random = np.random.default_rng(seed)
    views = pair(random, shape(random, flat=flat))
    view = estimate(views.current_px, views.desired_px, noise_px=0.1)
    candidates = [view, *view.alternatives]
    truth = views.T_star_camera
    turns = [so3_log(c.rotation.T @ truth[:3, :3]) for c in candidates]
    view = candidates[int(np.argmin([np.linalg.norm(turn) for turn in turns]))]
    d = distance_of(view, views.points_star)
    assert view.planar == flat
    assert view.inliers.all()
    np.testing.assert_allclose(view.T_star_camera(d), truth, atol=1e-7)
    np.testing.assert_allclose(view.points_star(d), views.points_star, atol=1e-7)
    current = transform_points(se3_inverse(truth), views.points_star)
    np.testing.assert_allclose(d * view.rho, current[:, 2], atol=1e-7)


def test_parts_of_a_reconstruction_agree_as_the_paper_says() -> None:
    random = np.random.default_rng(3)
    views = pair(random, shape(random))
    view = estimate(views.current_px, views.desired_px, noise_px=0.1)
    rays_star = np.column_stack((view.m_star, np.ones(9)))
    rays = np.column_stack((CAMERA.normalize(views.current_px), np.ones(9)))
    np.testing.assert_allclose(1 / view.rho_star, rays_star @ view.normal - view.delta, atol=1e-9)
    # (2) with β e = δ Rᵀ t_d: what the homography leaves over is parallax along the epipole.
    mapped = rays_star @ view.homography.T + np.outer(
        view.delta, view.rotation.T @ view.translation
    )
    np.testing.assert_allclose(mapped / mapped[:, 2:], rays, atol=1e-8)
    np.testing.assert_allclose(mapped[:, 2], view.rho / view.rho_star, atol=1e-8)


def test_reference_plane_lies_on_the_chosen_points() -> None:
    random = np.random.default_rng(5)
    views = pair(random, shape(random))
    view = estimate(views.current_px, views.desired_px, noise_px=0.1, reference=[1, 4, 6])
    np.testing.assert_allclose(view.delta[[1, 4, 6]], 0.0, atol=1e-9)


def test_flat_object_without_a_hint_is_taken_to_face_the_camera() -> None:
    random = np.random.default_rng(8)
    views = pair(random, shape(random, flat=True))
    view = estimate(views.current_px, views.desired_px)
    assert view.alternative is not None
    assert view.normal[2] >= view.alternative.normal[2]
    other = estimate(views.current_px, views.desired_px, normal_hint=view.alternative.normal)
    np.testing.assert_allclose(other.normal, view.alternative.normal, atol=1e-9)


def test_covariance_matches_the_spread_of_repeated_measurements() -> None:
    random = np.random.default_rng(11)
    points = shape(random, 20)
    views = pair(random, points)
    upsilons, predicted = [], []
    for _ in range(300):
        noise = 0.2 * random.normal(size=(2, 20, 2))
        view = estimate(
            views.current_px + noise[0],
            views.desired_px + noise[1],
            noise_px=0.2,
            reference=[0, 1, 2],
        )
        upsilons.append(view.upsilon)
        predicted.append(np.diag(view.covariance))
    # 300 samples know a variance to within 8 %. The noise is not taken to be less than stated, and
    # each match may be wrong, so deviations may be half as large again as those of right matches.
    ratio = np.var(upsilons, axis=0) / np.mean(predicted, axis=0)
    assert (ratio > 0.4).all()
    assert (ratio < 1.5).all()


@pytest.mark.parametrize(("kind", "most_wrong"), [("plane", 0.02), ("general", 0.03)])
def test_motions_are_within_their_deviations(kind: str, most_wrong: float) -> None:
    answers = [
        answer
        for scene in range(0, 500, len(KINDS))
        for answer in try_scene(np.random.default_rng([3, scene]), KINDS.index(kind))
        if answer.explanations
    ]
    off = np.array([answer.deviations for answer in answers])
    assert len(off) > 30
    assert np.mean(off > 5.0) <= most_wrong
    assert np.quantile(off, 0.9) > 0.7  # and they are not stated to be anywhere


# Scenes of the study in which one to three wrong matches, far from the others, bend the motion
# until they agree: by three degrees at most, but across a narrow valley of the error.
@pytest.mark.parametrize("scene", [1077, 1482, 1832, 1922, 2297, 3552])
def test_deviations_cover_a_motion_that_wrong_matches_bend(scene: int) -> None:
    (answer,) = try_scene(np.random.default_rng([0, 0, scene]), KINDS.index("general"))
    assert answer.explanations > 0
    assert answer.deviations < 5.0


# In turn: a wrong match without which a long valley opens; three wrong ones that agree with a
# motion 90° aside; a reference plane that nearly holds the desired camera; a bent valley without
# any wrong match; and planes that are nearly frontal, or whose noise is more than stated.
@pytest.mark.parametrize(
    ("kind", "scene"),
    [("general", 2012), ("general", 182), ("general", 3087), ("general", 9672)]
    + [("near plane", 8256), ("plane", 1365), ("near plane", 8576)],
)
def test_deviations_cover_what_valleys_and_wrong_matches_leave_open(kind: str, scene: int) -> None:
    (answer,) = try_scene(np.random.default_rng([1000, 0, scene]), KINDS.index(kind))
    assert answer.explanations > 0
    assert answer.deviations < 5.0


# Two directions of the motion are so weak that the likely motions are a bent surface; optima of one
# valley, sharp by a wrong match that agrees with them, are taken for many and hide the true one.
@pytest.mark.parametrize(
    ("kind", "scene"),
    [("near plane", 2291), ("general", 5302), ("plane", 11160), ("near plane", 11581)],
)
def test_deviations_cover_bent_surfaces_of_likely_motions(kind: str, scene: int) -> None:
    (answer,) = try_scene(np.random.default_rng([7001, 0, scene]), KINDS.index(kind))
    assert answer.explanations > 0
    assert answer.deviations < 5.0


# Seven of eight or nine points happen to lie on the plane of a motion far longer than theirs.
@pytest.mark.parametrize("scene", [1257, 2527])
def test_a_plane_by_chance_does_not_hide_the_motion_of_all_points(scene: int) -> None:
    (answer,) = try_scene(np.random.default_rng([0, 0, scene]), KINDS.index("general"))
    assert answer.explanations != 1
    assert not answer.deviations > 5.0


def test_reference_plane_of_wrong_matches_is_refused_though_a_plane_is_a_rival() -> None:
    (answer,) = try_scene(np.random.default_rng([0, 0, 1862]), KINDS.index("general"))
    assert answer.explanations == 0
    assert "points of the reference plane agree" in answer.reason


def test_reference_plane_seen_edge_on_is_refused() -> None:
    random = np.random.default_rng(5)
    views = pair(random, shape(random, 12))
    star = views.points_star.copy()
    star[2] = 0.9 * (0.4 * star[0] + 0.6 * star[1])  # in a plane with the desired camera's centre
    now = transform_points(se3_inverse(views.T_star_camera), star)
    noise = 0.3 * random.normal(size=(2, 12, 2))
    result = estimate_two_view(
        CAMERA.project(now) + noise[0],
        CAMERA.project(star) + noise[1],
        CAMERA,
        noise_px=0.3,
        reference=np.arange(3),
    )
    assert isinstance(result, TwoViewFailure)
    assert result.problem is TwoViewProblem.COLLINEAR


def test_noise_of_nine_marks_leaves_about_one_degree() -> None:
    random = np.random.default_rng(2)
    errors = []
    for _ in range(60):
        views = pair(random, shape(random), 0.3)
        result = estimate_two_view(views.current_px, views.desired_px, CAMERA, noise_px=0.3)
        if result:
            turn = so3_log(result.rotation.T @ views.T_star_camera[:3, :3])
            errors.append(np.degrees(np.linalg.norm(turn)))
    assert len(errors) >= 58
    assert np.median(errors) < 2.0


@pytest.mark.parametrize(
    ("flat", "count", "wrong"), [(False, 30, 8), (True, 20, 7), (False, 10, 1)]
)
def test_wrong_matches_are_dropped(flat: bool, count: int, wrong: int) -> None:
    random = np.random.default_rng(17)
    views = pair(random, shape(random, count, flat))
    current = views.current_px.copy()
    current[:wrong] += random.choice([-1.0, 1.0], (wrong, 2)) * random.uniform(25, 60, (wrong, 2))
    view = estimate(current, views.desired_px, noise_px=0.3)
    assert not view.inliers[:wrong].any()
    assert view.inliers[wrong:].all()
    assert np.isnan(view.rho[:wrong]).all()


def test_matches_at_random_are_refused() -> None:
    random = np.random.default_rng(23)
    current, desired = random.uniform(0, 480, (2, 12, 2))
    assert refusal(current, desired).problem is TwoViewProblem.WRONG_MATCHES


def test_turn_without_translation_is_refused_with_the_rotation() -> None:
    random = np.random.default_rng(29)
    points = transform_points(pose_facing(random), shape(random))
    R = so3_exp(np.array([0.02, -0.03, 0.4]))
    failure = refusal(CAMERA.project(points @ R.T), CAMERA.project(points))
    assert failure.problem is TwoViewProblem.NO_TRANSLATION
    assert failure.rotation is not None
    np.testing.assert_allclose(failure.rotation, R.T, atol=1e-8)


def test_same_image_twice_is_no_translation() -> None:
    random = np.random.default_rng(31)
    px = CAMERA.project(transform_points(pose_facing(random), shape(random)))
    assert refusal(px, px).problem is TwoViewProblem.NO_TRANSLATION


def test_three_points_are_too_few() -> None:
    px = np.array([[10.0, 10.0], [50.0, 20.0], [30.0, 90.0]])
    assert refusal(px, px + 5).problem is TwoViewProblem.TOO_FEW


@pytest.mark.parametrize("count", [5, 6, 7])
def test_few_points_in_space_are_refused_or_have_both_motions(count: int) -> None:
    for seed in range(40):
        random = np.random.default_rng(seed)
        points = np.column_stack(
            (random.uniform(-0.2, 0.2, (count, 2)), random.uniform(0.8, 1.2, count))
        )
        T = se3(so3_exp(np.array([0.1, 0.2, 0.3])), np.array([0.1, 0.05, 0.1]))
        noise = 0.3 * random.normal(size=(2, count, 2))
        now = CAMERA.project(transform_points(T, points)) + noise[0]
        result = estimate_two_view(now, CAMERA.project(points) + noise[1], CAMERA, noise_px=0.3)
        if isinstance(result, TwoView):
            motions = (result, *result.alternatives)
            assert min(deviations(motion, se3_inverse(T)) for motion in motions) < 5.0
        else:
            assert result.problem is TwoViewProblem.TOO_FEW


def test_four_points_are_enough_for_an_object_known_to_be_flat() -> None:
    random = np.random.default_rng(37)
    views = pair(random, 0.15 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 0.8, 0], [-0.9, 1, 0]]))
    assert refusal(views.current_px, views.desired_px).problem is TwoViewProblem.TOO_FEW
    view = estimate(views.current_px, views.desired_px, flat=True)
    assert view.planar
    assert min(v.apart_deg(estimate_truth(views, view)) for v in (view, *view.alternatives)) < 0.1


def estimate_truth(views: Pair, like: TwoView) -> TwoView:
    """Return a reconstruction with the true rotation."""
    return replace(like, rotation=views.T_star_camera[:3, :3])


def test_unrelated_matches_are_refused() -> None:
    for seed in range(60):
        random = np.random.default_rng(seed)
        count = int(random.integers(5, 80))
        current, desired = random.uniform(0, 480, (2, count, 2))
        assert not estimate_two_view(current, desired, CAMERA), seed


@pytest.mark.parametrize("flat", [False, True])
def test_more_and_noisier_matches_are_no_reason_to_refuse(flat: bool) -> None:
    random = np.random.default_rng(51)
    views = pair(random, shape(random, 300, flat), 1.2)
    view = estimate(views.current_px, views.desired_px, noise_px=0.5)
    assert view.planar == flat
    assert view.noise_px == pytest.approx(1.2, rel=0.2)
    motions = (view, *view.alternatives)
    assert min(deviations(motion, views.T_star_camera) for motion in motions) < 5.0


def test_object_that_moves_before_a_fixed_background_has_its_own_motion() -> None:
    random = np.random.default_rng(53)
    views = pair(random, shape(random, 40), 0.3)
    ground = random.uniform(0, 480, (80, 2))
    still = ground + 0.3 * random.normal(size=(80, 2))
    current = np.concatenate((still, views.current_px))
    view = estimate(current, np.concatenate((ground, views.desired_px)), noise_px=0.3)
    assert not view.inliers[:80].any()
    assert view.inliers[80:].mean() > 0.9
    assert "background" in view.doubt
    assert deviations(view, views.T_star_camera) < 5.0


def test_two_motions_are_said_with_how_far_apart_they_are_and_what_would_decide() -> None:
    random = np.random.default_rng(8)
    views = pair(random, shape(random, flat=True))
    view = estimate(views.current_px, views.desired_px)
    assert view.ambiguous
    assert f"{view.apart_deg(view.alternatives[0]):.0f}° apart" in view.doubt
    assert "third image" in view.doubt


def test_answers_over_random_scenes_are_rarely_wrong_and_certain() -> None:
    counts = count_answers(60, seed=1)
    assert sum(kind["wrong"] for kind in counts.values()) <= 1
    assert counts["unrelated"]["refused"] == 15
    assert counts["general"]["right"] + counts["general"]["ambiguous"] >= 4


@pytest.mark.parametrize(
    ("ratio", "freedom", "below"), [(1.9, 77, 75), (5.0, 30, 19), (3.0, 9, 1e9)]
)
def test_ratio_of_mean_squares_is_as_unlikely_as_its_deviate(
    ratio: float, freedom: float, below: float
) -> None:
    exact = stats.norm.isf(stats.f.sf(ratio, freedom, below))
    assert normal_deviate_of_ratio(ratio, freedom, below) == pytest.approx(exact, rel=0.02)


def test_coincident_points_are_refused() -> None:
    random = np.random.default_rng(41)
    points = shape(random, 3)[[0, 1, 2, 0, 1, 2, 0, 1, 2]]
    views = pair(random, points)
    assert refusal(views.current_px, views.desired_px).problem is TwoViewProblem.COINCIDENT


def test_collinear_points_are_refused() -> None:
    random = np.random.default_rng(43)
    points = np.outer(np.linspace(-1, 1, 9), [0.1, 0.05, 0.02])
    points[4] += [0.0, 0.05, 0.0]
    views = pair(random, points)
    assert refusal(views.current_px, views.desired_px).problem is TwoViewProblem.COLLINEAR


def test_bad_arguments_are_named() -> None:
    with pytest.raises(ShapeError, match="points_star_px"):
        estimate_two_view(np.zeros((9, 2)), np.zeros((8, 2)), CAMERA)
    with pytest.raises(InputError, match="reference"):
        estimate_two_view(np.zeros((9, 2)), np.zeros((9, 2)), CAMERA, reference=np.array([1, 12]))


def test_points_that_are_not_finite_are_refused_by_name() -> None:
    px = np.full((9, 2), 100.0)
    px[3, 1] = np.nan
    with pytest.raises(InputError, match="points_star_px"):
        estimate_two_view(np.zeros((9, 2)), px, CAMERA)
