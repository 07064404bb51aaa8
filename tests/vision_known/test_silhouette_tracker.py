"""An object without edges is measured by its outline, and what no outline tells is said."""

import numpy as np
import pytest
from ball_scene import RADIUS, ball_place, colored_clutter, drawn_ball, outline_of_ball
from known_scene import CAMERA, box_model

from vergence.camera.lens import pack_lens
from vergence.errors import InputError
from vergence.estimation.known_object.object_follower import OUTLINE_RULE, ObjectFollower, Sighting
from vergence.geometry import moved_pose, se3, so3_exp
from vergence.vision.known_object import ObjectModel, SilhouetteTracker, free_axes, shown_by_edges
from vergence.vision.known_object.contour_fit import fit_contour, outline_motion
from vergence.vision.known_object.contour_lines import BEYOND, REACH, ContourLines, read_lines
from vergence.vision.known_object.primitives import cylinder, ellipsoid
from vergence.vision.known_object.silhouette import Outline, outline_of
from vergence.vision.known_object.weak_turns import like_ellipsoid

BALL = ObjectModel.from_mesh("ball", *ellipsoid((RADIUS, RADIUS, RADIUS)))
LOOSE = np.diag(np.repeat([0.004, 0.04], 3) ** 2)


@pytest.fixture(scope="module")
def tracker() -> SilhouetteTracker:
    return SilhouetteTracker(BALL)


def test_places_on_the_outline_of_a_ball_are_where_lines_of_sight_touch_it() -> None:
    place = np.array((0.03, -0.02, 0.35))
    T = se3(so3_exp(np.array((0.3, 0.2, 0.1))), place)
    outline = outline_of(T, pack_lens(CAMERA), BALL.vertices, BALL.triangles, True, 150)
    assert outline is not None
    touched = outline_of_ball(place, 2000)
    nearest = np.argmin(
        np.linalg.norm(outline.points_px[:, None] - CAMERA.project(touched), axis=2), axis=1
    )
    away = outline.points_px - CAMERA.project(touched[nearest])
    assert abs(np.mean(np.einsum("ni,ni->n", away, outline.normals))) < 0.15
    assert np.abs(away).max() < 0.6
    in_camera = outline.points @ T[:3, :3].T + T[:3, 3]
    assert np.abs(in_camera[:, 2] - touched[nearest, 2]).mean() < 0.06 * RADIUS


def test_a_line_finds_the_contour_where_the_product_over_its_pixels_is_greatest() -> None:
    rng = np.random.default_rng(5)
    odds = np.zeros((16, 64))
    odds[:, :] = np.linspace(-3.0, 3.0, 64)
    for _ in range(20):
        row = rng.integers(0, 256, 61).astype(np.uint8)
        row[: 28 + rng.integers(5)] |= 128
        image = np.repeat(row[None, :, None], 5, axis=0)
        one = np.array([[30.0, 2.0]])
        far = np.full(1, 30.0)
        outline = Outline(np.zeros((1, 3)), one, np.array([[1.0, 0.0]]), far, far)
        lines = read_lines(image, outline, odds, 1)
        size = REACH + BEYOND
        shares = 1.0 / (1.0 + np.exp(-odds[0, row[30 - size : 31 + size] // 4]))
        places = np.arange(-REACH, REACH + 1)
        inner = 0.5 - 0.43 * np.tanh(np.arange(-size, size + 1)[None] - places[:, None])
        chance = np.prod(inner * shares + (1.0 - inner) * (1.0 - shares), axis=1)
        chance /= chance.sum()
        assert lines.offsets_px[0] == pytest.approx(chance @ places)
        variance = max(chance @ places**2 - (chance @ places) ** 2, 0.05)
        known = max(1.0 / variance - 12.0 / (2 * REACH + 1) ** 2, 0.0)
        assert lines.information[0] == pytest.approx(known)


@pytest.mark.parametrize("seed", range(4))
def test_lines_that_err_alike_do_not_draw_the_outline_along(seed: int) -> None:
    """Weighing each line for itself, the outline moves by 0.4 px or more."""
    rng = np.random.default_rng(seed)
    T, lens = se3(np.eye(3), np.array((0.01, -0.01, 0.35))), pack_lens(CAMERA)
    outline = outline_of(T, lens, BALL.vertices, BALL.triangles, True, 200)
    assert outline is not None
    count = len(outline.points)
    sure, anywhere = np.ones(count), np.eye(6)

    def fitted(offsets_px: np.ndarray) -> np.ndarray:
        lines = ContourLines(offsets_px, sure, sure > 0.0, sure)
        fit = fit_contour(T, T, anywhere, lens, outline, lines, sure, 1.5, 0.6, 3)
        moved: np.ndarray = CAMERA.project(fit[None, :3, 3])[0] - CAMERA.project(T[None, :3, 3])[0]
        return moved

    noise = rng.normal(0.0, 0.5, count)
    alike = noise + np.where(np.arange(count) < 40, 1.5, 0.0)
    assert np.linalg.norm(fitted(alike) - fitted(noise)) < 0.15
    # What moved as a whole is followed as a whole.
    shift = np.array((0.8, -0.5))
    assert fitted(noise + outline.normals @ shift) == pytest.approx(shift + fitted(noise), abs=0.15)


def test_the_motion_of_an_outline_has_the_slopes_that_are_stated() -> None:
    T, lens = (
        se3(so3_exp(np.array((0.2, -0.1, 0.3))), np.array((0.02, -0.01, 0.35))),
        pack_lens(CAMERA),
    )
    outline = outline_of(T, lens, BALL.vertices, BALL.triangles, True, 60)
    assert outline is not None
    moved, slopes = outline_motion(T, lens, outline)
    assert np.abs(moved).max() < 1e-9
    for axis, step in enumerate(1e-6 * np.eye(6)):
        ahead, _ = outline_motion(moved_pose(T, step), lens, outline)
        behind, _ = outline_motion(moved_pose(T, -step), lens, outline)
        assert (ahead - behind) / 2e-6 == pytest.approx(slopes[:, axis], rel=1e-5, abs=1e-3)
    away = se3(np.eye(3), np.array((0.0, 0.0, -1.0)))
    assert np.isnan(outline_motion(away, lens, outline)[0]).all()


def test_one_image_gives_the_place_of_a_ball_and_none_of_its_turns(
    tracker: SilhouetteTracker,
) -> None:
    rng = np.random.default_rng(1)
    for k in range(6):
        place = ball_place(4 * k)
        image = drawn_ball(place, rng, colored_clutter(rng))
        start = se3(np.eye(3), place + rng.normal(0.0, 0.003, 3))
        seen = tracker.measure(image, CAMERA, start, LOOSE, tracker.blank())
        assert seen.share > 0.6
        assert seen.T_camera_target[:3, 3] == pytest.approx(place, abs=0.003)
        assert seen.T_camera_target[:2, 3] == pytest.approx(place[:2], abs=0.0006)
        assert seen.unseen.shape == (6, 3)


def test_colours_are_not_learned_where_the_outline_lies_beside_the_contour(
    tracker: SilhouetteTracker,
) -> None:
    """Otherwise the colours would come to say that a wrong pose is right."""
    rng = np.random.default_rng(2)
    ground, place = colored_clutter(rng), ball_place(3)
    held = np.diag(np.repeat([1e-6, 1e-5], 3) ** 2)
    right, aside = (se3(np.eye(3), place + np.array((x, 0.0, 0.0))) for x in (0.0, 0.001))
    memory = tracker.blank()
    for T in (right, *[aside] * 30):
        seen = tracker.measure(drawn_ball(place, rng, ground), CAMERA, T, held, memory)
        memory = tracker.remember(memory, seen)
    free = tracker.measure(drawn_ball(place, rng, ground), CAMERA, aside, LOOSE, memory)
    assert abs(free.T_camera_target[0, 3] - place[0]) < 0.00004


def followed(tracker: SilhouetteTracker, count: int, posts: bool) -> list[tuple[str, float, float]]:
    rng = np.random.default_rng(3)
    ground = colored_clutter(rng)
    start = se3(np.eye(3), ball_place(0) + 0.001)
    follower = ObjectFollower(tracker, CAMERA, start, 0.0, 0.04, OUTLINE_RULE)
    steps = []
    for k in range(count):
        place = ball_place(k)
        post = (80 + 9 * k, 115 + 9 * k) if posts else None
        step = follower.follow(drawn_ball(place, rng, ground, post), 0.04 * k)
        error = step.T_camera_target[:3, 3] - place
        square = error @ np.linalg.solve(step.covariance[:3, :3], error)
        steps.append((step.sighting, float(np.linalg.norm(error)), float(square)))
    return steps


def test_an_outline_beside_the_contour_has_a_large_misfit(tracker: SilhouetteTracker) -> None:
    rng = np.random.default_rng(2)
    place, held = ball_place(3), np.diag(np.repeat([1e-6, 1e-5], 3) ** 2)
    image = drawn_ball(place, rng, colored_clutter(rng))
    T = se3(np.eye(3), place)
    memory = tracker.remember(
        tracker.blank(), tracker.measure(image, CAMERA, T, held, tracker.blank())
    )
    beside = se3(np.eye(3), place + (0.0, 0.0, 0.01))  # its radius in the image is 3 % smaller
    fits, misfits = (tracker.measure(image, CAMERA, pose, held, memory) for pose in (T, beside))
    assert fits.misfit_px < 0.4
    assert not fits.searched
    assert misfits.misfit_px > 0.8
    assert misfits.searched  # in vain: the pose is held
    assert np.trace(misfits.shared) > 3.0 * np.trace(fits.shared)  # so it tells that it is unsure


def test_a_post_that_passes_before_a_ball_does_not_draw_it_along(
    tracker: SilhouetteTracker,
) -> None:
    steps = followed(tracker, 16, posts=True)
    assert all(sighting is Sighting.SEEN for sighting, _, _ in steps)
    assert max(error for _, error, _ in steps) < 0.006
    assert max(square for _, _, square in steps) < 16.0


def test_a_ball_that_goes_is_not_seen(tracker: SilhouetteTracker) -> None:
    rng = np.random.default_rng(4)
    ground = colored_clutter(rng)
    start = se3(np.eye(3), ball_place(0))
    follower = ObjectFollower(tracker, CAMERA, start, 0.0, 0.04, OUTLINE_RULE)
    for k in range(3):
        follower.follow(drawn_ball(ball_place(k), rng, ground), 0.04 * k)
    gone = [follower.follow(ground, 0.04 * k) for k in range(3, 6)]
    assert all(step.sighting is Sighting.PREDICTED for step in gone)
    assert "of the outline expected found" in gone[0].reason


def test_turns_without_any_change_of_the_outline_are_known_beforehand() -> None:
    can = ObjectModel.from_mesh("can", *cylinder(0.03, 0.05))
    axes = free_axes(can)
    assert np.abs(axes.axes) == pytest.approx(np.array([[0.0, 0.0, 1.0]]))
    assert len(free_axes(box_model()).axes) == 0
    assert len(free_axes(BALL).axes) == 3
    pebble = ObjectModel.from_mesh("pebble", *ellipsoid((0.06, 0.042, 0.028)))
    assert like_ellipsoid(pebble, free_axes(pebble))
    assert not like_ellipsoid(can, axes)


def test_the_model_decides_between_edges_and_outline() -> None:
    assert shown_by_edges(box_model())
    assert not shown_by_edges(BALL)
    assert not shown_by_edges(ObjectModel.from_mesh("can", *cylinder(0.03, 0.05)))


def test_images_of_another_kind_are_refused(tracker: SilhouetteTracker) -> None:
    grey = np.zeros((CAMERA.height, CAMERA.width), np.uint8)
    with pytest.raises(InputError, match="allowed: uint8 of shape"):
        tracker.measure(grey, CAMERA, np.eye(4), LOOSE, tracker.blank())
    with pytest.raises(InputError, match="1 or 3"):
        SilhouetteTracker(BALL, channels=2)
