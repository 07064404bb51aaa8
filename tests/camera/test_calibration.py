"""Calibration: its slopes, its deviations against many repetitions, and what it refuses."""

import numpy as np
import pytest
from calibration_scene import BOARD, CAMERA, Scene, scene, views

from vergence.camera.calibration import (
    CalibrationFailure,
    LensFit,
    MountingFit,
    Noise,
    fit_lens,
    fit_mounting,
    free_parameters,
)
from vergence.camera.calibration.board_pose import board_pose
from vergence.camera.calibration.hand_eye import Mounting, closed_form
from vergence.camera.calibration.joint_fit import PARAMETERS, JointProblem, State
from vergence.camera.calibration.normal_equations import steps_without
from vergence.camera.calibration.reprojection import lens_of, reproject, residuals, rms
from vergence.geometry import (
    matrix_to_quaternion,
    quaternion_to_matrix,
    se3,
    se3_exp,
    se3_inverse,
    so3_log,
    transform_points,
)

FREE = free_parameters("full")
HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
HALF_TURN[:3, 3] = 2 * BOARD.mean(axis=0)


def lens(seen, **options) -> LensFit:
    fit = fit_lens(seen, 640, 480, **options)
    assert isinstance(fit, LensFit), fit
    return fit


def mounted(
    given: Scene, fixed=False, sightings=None, rng=None, **options
) -> MountingFit | CalibrationFailure:
    fit = lens(given.sightings)
    assert len(fit.sightings) == len(given.sightings)
    return fit_mounting(
        sightings or [(seen,) for seen in given.sightings],
        given.T_base_flange,
        fit.camera,
        fit.noise_px,
        fixed=fixed,
        free=FREE,
        rng=rng or np.random.default_rng(0),
        **options,
    )


def errors(fit: MountingFit, given: Scene) -> np.ndarray:
    """Lens, position and rotation of the camera, less the truth, (15,)."""
    turn = so3_log(fit.T_mount_camera[:3, :3] @ given.X[:3, :3].T)
    place = fit.T_mount_camera[:3, 3] - given.X[:3, 3]
    return np.concatenate((lens_of(fit.camera) - lens_of(CAMERA), place, turn))


def test_slopes_of_the_reprojection_are_those_of_finite_differences() -> None:
    rng, h = np.random.default_rng(0), 1e-6
    (seen, *_), (T, *_) = views(rng, 1)
    parameters = lens_of(CAMERA)
    _, by_lens, by_pose = reproject(parameters, T, seen.points)

    def pixels(lens, T):
        return reproject(lens, np.ascontiguousarray(T), seen.points)[0].ravel()

    for n in range(9):
        d = h * np.eye(9)[n] * (100.0 if n < 4 else 1.0)
        slope = (pixels(parameters + d, T) - pixels(parameters - d, T)) / (2 * d[n])
        np.testing.assert_allclose(by_lens[:, n], slope, rtol=1e-5, atol=1e-6)
    for n in range(6):
        d = h * np.eye(6)[n]
        slope = pixels(parameters, se3_exp(d) @ T) - pixels(parameters, se3_exp(-d) @ T)
        np.testing.assert_allclose(by_pose[:, n], slope / (2 * h), rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize("fixed", [False, True])
def test_slopes_of_the_joint_problem_are_those_of_finite_differences(fixed: bool) -> None:
    rng, h = np.random.default_rng(1), 1e-6
    given = scene(rng, 3, fixed)
    A = given.T_base_flange if fixed else np.array([se3_inverse(T) for T in given.T_base_flange])
    problem = JointProblem(tuple(given.sightings), A, CAMERA, FREE, fixed, 0.01)
    mounting, noise = Mounting(given.X, given.Y), Noise(0.1, 2e-3, 3e-3)
    state = State(lens_of(CAMERA), mounting, 0.02, rng.normal(0.0, 0.02, (3, 6)))
    block = problem.block(state, 1, noise)

    def slope(step: np.ndarray, own: np.ndarray) -> np.ndarray:
        ahead, behind = (
            problem.block(state.moved(h * s * step, h * s * own), 1, noise) for s in (1, -1)
        )
        return (ahead.residual - behind.residual) / (2 * h)

    for n in range(PARAMETERS):
        expected = slope(np.eye(PARAMETERS)[n], np.zeros((3, 6)))
        close = {"rtol": 2e-4, "atol": 2e-2 + 1e-6 * abs(expected).max()}
        np.testing.assert_allclose(block.J[:, n], expected, **close)
    for n in range(6):
        own = np.zeros((3, 6))
        own[1, n] = 1.0
        expected = slope(np.zeros(PARAMETERS), own)
        close = {"rtol": 2e-4, "atol": 2e-2 + 1e-6 * abs(expected).max()}
        np.testing.assert_allclose(block.own[:, n], expected, **close)


@pytest.mark.parametrize("fixed", [False, True])
def test_the_closed_form_is_exact_without_noise(fixed: bool) -> None:
    given = scene(np.random.default_rng(2), 6, fixed, noise_px=0.0)
    A = given.T_base_flange if fixed else np.array([se3_inverse(T) for T in given.T_base_flange])
    T = np.array([board_pose(CAMERA, seen) for seen in given.sightings])
    found = closed_form(A, T)
    np.testing.assert_allclose(found.X, given.X, atol=1e-7)
    np.testing.assert_allclose(found.Y, given.Y, atol=1e-7)


def test_a_lens_is_found_and_its_deviations_are_those_of_repetitions() -> None:
    ratios = []
    for seed in range(30):
        fit = lens(views(np.random.default_rng(seed), 20)[0])
        assert fit.noise_px == pytest.approx(0.1, rel=0.08)
        ratios.append((lens_of(fit.camera) - lens_of(CAMERA)) / fit.deviations)
        assert (fit.deviations[:2] < 1e-3 * CAMERA.fx).all()
    spread = np.sqrt(np.mean(np.square(ratios), axis=0))
    assert (spread > 0.7).all()
    assert (spread < 1.35).all()


@pytest.mark.parametrize("fixed", [False, True], ids=["in hand", "to hand"])
def test_the_mounting_is_found_within_the_aim_at_a_tenth_of_a_pixel(fixed: bool) -> None:
    ratios = []
    for seed in range(12):
        given = scene(np.random.default_rng(seed), 25, fixed)
        fit = mounted(given, fixed)
        assert isinstance(fit, MountingFit)
        assert fit.bad == ()
        off = errors(fit, given)
        assert abs(off[0]) / CAMERA.fx < 1e-3
        assert np.linalg.norm(off[9:12]) < 0.5e-3
        assert np.rad2deg(np.linalg.norm(off[12:])) < 0.05
        ratios.append(off / fit.deviations[:15])
    spread = np.sqrt(np.mean(np.square(ratios)))
    assert 0.75 < spread < 1.25


@pytest.mark.parametrize("fixed", [False, True], ids=["in hand", "to hand"])
def test_errors_of_the_arm_are_estimated_and_counted_in(fixed: bool) -> None:
    ratios, arm = [], []
    for seed in range(10):
        given = scene(np.random.default_rng(seed), 25, fixed, arm_m=4e-4, arm_rad=6e-4)
        fit = mounted(given, fixed)
        assert isinstance(fit, MountingFit)
        ratios.append(errors(fit, given) / fit.deviations[:15])
        arm.append(fit.noise[1:])
    np.testing.assert_allclose(np.mean(arm, axis=0), (4e-4, 6e-4), rtol=0.15)
    assert 0.7 < np.sqrt(np.mean(np.square(ratios))) < 1.35


def test_a_image_left_out_is_predicted_as_by_a_fit_without_it() -> None:
    given = scene(np.random.default_rng(3), 12)
    whole = mounted(given)
    assert isinstance(whole, MountingFit)
    for number in (0, 5):
        others = [n for n in range(12) if n != number]
        part = Scene([given.sightings[n] for n in others], given.T_base_flange[others], *given[2:])
        fit = mounted(part)
        assert isinstance(fit, MountingFit)
        X, Y = fit.T_mount_camera, fit.T_mount_board
        T = se3_inverse(X) @ se3_inverse(given.T_base_flange[number]) @ Y
        missed = rms(residuals(lens_of(fit.camera), T, given.sightings[number]))
        assert whole.left_out_px[number] == pytest.approx(missed, rel=0.05)


def test_leaving_out_is_one_step_of_gauss_and_newton() -> None:
    rng = np.random.default_rng(4)
    from vergence.camera.calibration.normal_equations import Share

    J, target = rng.normal(size=(6, 8, 3)), rng.normal(size=(6, 8))
    best = np.linalg.lstsq(J.reshape(-1, 3), target.ravel())[0]
    shares = [Share.of(Ji, Ji @ best - ti) for Ji, ti in zip(J, target, strict=True)]
    steps = steps_without(shares, np.ones(3))
    for n in range(6):
        rest = [k for k in range(6) if k != n]
        alone = np.linalg.lstsq(J[rest].reshape(-1, 3), target[rest].ravel())[0]
        np.testing.assert_allclose(best + steps[n], alone, atol=1e-10)


@pytest.mark.parametrize("fixed", [False, True], ids=["in hand", "to hand"])
def test_swapped_poses_and_moved_boards_are_named_and_do_no_harm(fixed: bool) -> None:
    given = scene(np.random.default_rng(5), 22, fixed)
    arm = given.T_base_flange.copy()
    arm[[2, 5, 11]] = arm[[5, 11, 2]]
    arm[17] = arm[17] @ se3_exp(np.array([0.004, 0.0, 0.0, 0.0, 0.01, 0.0]))
    fit = mounted(given._replace(T_base_flange=arm), fixed)
    assert isinstance(fit, MountingFit)
    assert [bad.name for bad in fit.bad] == ["002.png", "005.png", "011.png", "017.png"]
    assert all(bad.residual_px > 3.0 for bad in fit.bad)
    off = errors(fit, given)
    assert np.linalg.norm(off[9:12]) < 0.5e-3
    assert np.rad2deg(np.linalg.norm(off[12:])) < 0.05


def test_boards_that_look_the_same_upside_down_are_turned_the_right_way() -> None:
    rng = np.random.default_rng(6)
    given = scene(rng, 15)
    sightings = []
    for seen in given.sightings:
        turned = seen._replace(points=transform_points(HALF_TURN, seen.points))
        sightings.append((seen, turned) if rng.random() < 0.5 else (turned, seen))
    fit = mounted(given, sightings=sightings)
    assert isinstance(fit, MountingFit)
    assert fit.bad == ()
    assert np.linalg.norm(errors(fit, given)[9:12]) < 0.5e-3


def test_blurred_images_and_other_boards_are_named_and_do_no_harm() -> None:
    rng = np.random.default_rng(7)
    seen, _ = views(rng, 20)
    seen[3] = seen[3]._replace(points_px=seen[3].points_px + rng.normal(0, 3.0, (88, 2)))
    seen[9] = seen[9]._replace(points_px=np.roll(seen[9].points_px, 1, axis=0))
    fit = lens(seen)
    assert sorted(bad.name for bad in fit.bad) == ["003.png", "009.png"]
    assert abs(fit.camera.fx / CAMERA.fx - 1) < 1e-3
    assert fit.noise_px == pytest.approx(0.1, rel=0.08)


def test_a_board_that_is_never_tilted_cannot_tell_the_focal_length() -> None:
    fit = fit_lens(views(np.random.default_rng(8), 12, tilt=0.02)[0], 640, 480)
    assert not fit
    assert "add images with the board tilted" in str(fit)


def test_too_few_images_are_refused_in_words() -> None:
    fit = fit_lens(views(np.random.default_rng(9), 3)[0], 640, 480)
    assert not fit
    assert "found in 3 different images; at least 4" in str(fit)
    given = scene(np.random.default_rng(9), 4)
    assert "there are 4 images" in str(mounted(given))


def test_an_arm_that_turned_about_one_axis_only_is_refused_in_words() -> None:
    rng = np.random.default_rng(10)
    given = scene(rng, 15)
    turned = [se3_exp(np.array([0.0, 0, 0, 0, 0, a])) for a in rng.uniform(-1, 1, 15)]
    alike = np.array([given.T_base_flange[0] @ T for T in turned])
    assert "turned about one axis only" in str(mounted(given._replace(T_base_flange=alike)))
    still = np.repeat(given.T_base_flange[:1], 15, axis=0)
    assert "hardly turned" in str(mounted(given._replace(T_base_flange=still)))


def test_poses_that_have_nothing_to_do_with_the_images_are_refused() -> None:
    given = scene(np.random.default_rng(11), 15)
    other = scene(np.random.default_rng(12), 15)
    fit = mounted(given._replace(T_base_flange=other.T_base_flange))
    assert not fit
    assert "contradict each other" in str(fit)


@pytest.mark.parametrize("fixed", [False, True], ids=["in hand", "to hand"])
def test_the_mistake_that_was_made_is_named(fixed: bool) -> None:
    given = scene(np.random.default_rng(15), 15, fixed)
    arm = given.T_base_flange
    other = mounted(given, fixed=not fixed)
    assert "mounted the other way" in (other.hint if other else str(other))
    q = [matrix_to_quaternion(np.ascontiguousarray(T[:3, :3])) for T in arm]
    mixed = np.array([quaternion_to_matrix(np.roll(each, -1)) for each in q])
    wrong = np.array([se3(R, T[:3, 3].copy()) for R, T in zip(mixed, arm, strict=True)])
    wrongly_read = mounted(given._replace(T_base_flange=wrong), fixed)
    words = wrongly_read.hint if wrongly_read else str(wrongly_read)
    assert "in the order x, y, z, w" in words


@pytest.mark.parametrize("fixed", [False, True], ids=["in hand", "to hand"])
def test_a_board_of_another_size_is_noticed_and_does_no_harm(fixed: bool) -> None:
    for seed in range(3):
        given = scene(np.random.default_rng(seed), 15, fixed)
        larger = [s._replace(points=1.02 * s.points) for s in given.sightings]
        fit = mounted(given._replace(sightings=larger), fixed)
        assert isinstance(fit, MountingFit)
        assert fit.board_scale == pytest.approx(1 / 1.02, abs=5e-4)
        assert any("98.0 % of the size given" in words for words in fit.warnings)
        assert np.linalg.norm(errors(fit, given)[9:12]) < 0.5e-3


@pytest.mark.parametrize("deviation", [0.0, 0.01])
def test_the_deviation_of_the_mounting_contains_that_of_the_boards_size(deviation: float) -> None:
    # An arm good to 1 mm that hardly travels says little about the size of the board.
    ratios = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        given = scene(rng, 12, arm_m=1e-3, arm_rad=1e-3, tilt=0.3, roll=0.3)
        size = 1.0 + rng.normal(0.0, deviation)
        other = [s._replace(points=s.points / size) for s in given.sightings]
        fit = mounted(given._replace(sightings=other), scale_deviation=deviation)
        assert isinstance(fit, MountingFit)
        ratios.append(errors(fit, given)[9:12] / fit.deviations[9:12])
    assert np.sqrt(np.mean(np.square(ratios))) < 1.35


@pytest.mark.parametrize("arm", [(0.0, 0.0), (1e-3, 1e-3), (3e-3, 4e-3), (6e-3, 8e-3)])
def test_the_mounting_is_found_with_arms_of_any_precision(arm: tuple[float, float]) -> None:
    ratios = []
    for seed in range(4):
        given = scene(np.random.default_rng(seed), 12, arm_m=arm[0], arm_rad=arm[1])
        fit = mounted(given)
        assert isinstance(fit, MountingFit), fit
        assert fit.bad == ()
        ratios.append(errors(fit, given)[9:] / fit.deviations[9:15])
        np.testing.assert_allclose(fit.noise[1:], arm, rtol=0.6, atol=2e-5)
    assert np.sqrt(np.mean(np.square(ratios))) < 1.6


def test_a_fit_that_did_not_converge_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    given = scene(np.random.default_rng(0), 8, arm_m=3e-3, arm_rad=4e-3)
    monkeypatch.setattr("vergence.camera.calibration.solver._MOST_STEPS", 1)
    fit = mounted(given)
    assert not fit
    assert "did not converge" in str(fit)


def test_copies_of_an_image_count_once() -> None:
    rng = np.random.default_rng(0)
    seen, _ = views(rng, 6)
    again = [s._replace(name=f"copy of {s.name}") for s in seen]
    fit, twice = lens(seen), lens(seen + again)
    np.testing.assert_allclose(twice.deviations, fit.deviations, rtol=1e-6)
    assert [bad.name for bad in twice.bad] == [s.name for s in again]
    assert "at the same place as in 000.png" in twice.bad[0].reason
    alone = fit_lens([seen[0]._replace(name=f"{n}.png") for n in range(20)], 640, 480)
    assert not alone
    assert "found in 1 different images without 19 copies" in str(alone)


def test_a_lens_that_is_known_stays_as_it_is() -> None:
    given = scene(np.random.default_rng(13), 15)
    fit = fit_lens(given.sightings, 640, 480, known=CAMERA)
    assert isinstance(fit, LensFit)
    assert fit.camera is CAMERA
    assert (fit.deviations == 0).all()
    mounting = fit_mounting(
        [(seen,) for seen in given.sightings],
        given.T_base_flange,
        CAMERA,
        fit.noise_px,
        rng=np.random.default_rng(0),
    )
    assert isinstance(mounting, MountingFit)
    np.testing.assert_array_equal(lens_of(mounting.camera), lens_of(CAMERA))
    assert np.linalg.norm(errors(mounting, given)[9:12]) < 0.3e-3


@pytest.mark.parametrize("model", ["none", "k1", "k1k2", "k1k2p1p2"])
def test_only_the_desired_coefficients_are_estimated(model: str) -> None:
    fit = lens(views(np.random.default_rng(14), 12)[0], model=model)
    np.testing.assert_array_equal(fit.deviations > 0, free_parameters(model) > 0)
    assert (fit.camera.distortion[free_parameters(model)[4:] == 0] == 0).all()
