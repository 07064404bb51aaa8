"""The edges of an object give its pose, in any light that shows them."""

import cv2
import numpy as np
import pytest
from known_scene import CAMERA, box_model, clutter, drawn_image, off, pose, pose_error

from vergence.arrays import FloatArray, ImageArray
from vergence.camera.lens import pack_lens
from vergence.errors import InputError
from vergence.vision.known_object import EdgeTracker, ObjectModel
from vergence.vision.known_object.edge_kernel import measure_edges
from vergence.vision.known_object.edge_samples import LEAST_COSINE, EdgeSamples, Steps, sample_edges
from vergence.vision.known_object.profiles import find_steps, read_profile
from vergence.vision.known_object.shift_vote import SUPPORT_PX, vote_shift

MODEL = box_model()
LOOSE = np.diag(np.repeat([0.01, 0.1], 3) ** 2)


def steps_of(profile: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    places, heights, widths = np.zeros(5), np.zeros(5), np.zeros(5)
    count = find_steps(profile, reach, 5.0, places, heights, widths)
    return places[:count], heights[:count], widths[:count]


@pytest.mark.parametrize("shift", [-3.4, -0.5, 0.0, 0.3, 2.8])
def test_a_step_is_found_where_it_is(shift: float) -> None:
    k = np.arange(-20, 21)
    profile = 50.0 + 100.0 * np.clip(k - shift + 0.5, 0.0, 1.0)
    places, heights, _ = steps_of(profile, 8)
    assert len(places) == 1
    assert places[0] == pytest.approx(shift, abs=0.1)
    assert heights[0] == pytest.approx(100.0, rel=0.4)


@pytest.mark.parametrize("length", [6.0, 11.0, 15.0])
def test_a_blurred_step_is_found_in_the_middle_of_its_ramp(length: float) -> None:
    k = np.arange(-24, 25)
    profile = 50.0 + 120.0 * np.clip((k - 1.2) / length + 0.5, 0.0, 1.0)
    places, _, widths = steps_of(profile, 9)
    assert places[0] == pytest.approx(1.2, abs=0.3)
    assert widths[0] == pytest.approx(length, rel=0.3)


def test_a_profile_is_the_grey_values_along_the_normal() -> None:
    rows, columns = np.mgrid[0:60, 0:80]
    slope = np.asarray(np.rint(2.0 * columns + 1.0 * rows), np.uint8)
    profile = np.empty(21)
    assert read_profile(slope, 40.3, 30.6, 0.6, 0.8, profile)
    assert profile == pytest.approx(2.0 * 40.3 + 30.6 + 2.0 * np.arange(-10, 11), abs=0.02)
    assert not read_profile(slope, 8.0, 30.0, 1.0, 0.0, profile)


def votes(rng: np.random.Generator, shift: np.ndarray) -> tuple[EdgeSamples, Steps]:
    """Samples whose steps are where a shift puts them, among others that are anywhere."""
    count, candidates = 120, 4
    angle = rng.uniform(0, 2 * np.pi, count)
    normals = np.column_stack((np.cos(angle), np.sin(angle)))
    offsets = rng.uniform(-15, 15, (count, candidates))
    offsets[::2, 1] = normals[::2] @ shift + rng.normal(0, 0.4, count // 2)
    weights = rng.uniform(0.1, 1.0, (count, candidates))
    zeros = np.zeros(count, dtype=np.int64)
    samples = EdgeSamples(zeros, zeros, np.zeros((count, 3)), np.zeros((count, 2)), normals)
    none, looks = np.zeros((count, candidates)), np.zeros((count, candidates, 9))
    return samples, Steps(offsets, weights, none, none, looks, np.ones(count, np.bool_))


def test_the_vote_finds_what_a_trial_of_every_shift_finds() -> None:
    rng = np.random.default_rng(4)
    reach = 14
    for _ in range(20):
        samples, steps = votes(rng, rng.uniform(-9, 9, 2))
        scores = {}
        for x, y in np.argwhere(np.hypot(*np.indices((29, 29)) - 14) <= reach) - 14:
            across = samples.normals @ (x, y)
            miss = (steps.offsets - across[:, None]) / SUPPORT_PX
            support = (steps.weights * np.maximum(1.0 - miss**2, 0.0)).max(axis=1).sum()
            scores[(x, y)] = support * (1.0 - 0.25 * np.hypot(x, y) / reach)
        assert scores[vote_shift(samples, steps, reach)] > 0.995 * max(scores.values())


def test_without_steps_nothing_is_shifted() -> None:
    samples, steps = votes(np.random.default_rng(5), np.zeros(2))
    assert vote_shift(samples, steps._replace(weights=0.0 * steps.weights), 10) == (0.0, 0.0)


def test_only_edges_that_are_seen_are_expected() -> None:
    places = np.full(12, 10)
    samples = sample_edges(
        pose(), pack_lens(CAMERA), MODEL.edges, MODEL.edge_normals, MODEL.surface, places,
        LEAST_COSINE,
    )  # fmt: skip
    assert len(np.unique(samples.edge)) == 9  # of a box that shows three faces


@pytest.mark.parametrize("light", [0.1, 0.35, 1.0])
def test_one_image_gives_the_pose_from_a_rough_one(light: float) -> None:
    rng = np.random.default_rng(1)
    tracker = EdgeTracker(MODEL)
    for t in np.linspace(0.0, 6.0, 12):
        image = drawn_image(pose(t), rng, clutter(rng), light=light)
        seen = tracker.measure(
            image, CAMERA, off(pose(t), rng, 0.002, 0.02), LOOSE, tracker.blank()
        )
        metres, radians = pose_error(seen.T_camera_target, pose(t))
        assert seen.share > 0.75
        assert metres < 0.0015
        assert radians < 0.012


def test_the_edges_are_handed_on_as_points_known_across_the_edge_only() -> None:
    rng = np.random.default_rng(2)
    tracker = EdgeTracker(MODEL)
    seen = tracker.measure(drawn_image(pose(), rng), CAMERA, pose(), LOOSE, tracker.blank())
    truth = CAMERA.project(seen.points @ pose()[:3, :3].T + pose()[:3, 3])
    error = seen.points_px - truth
    squares = np.einsum("ni,nij,nj->n", error, np.linalg.inv(seen.covariance_px), error)
    assert squares.max() < 9.0
    spreads = np.sqrt(np.linalg.eigvalsh(seen.covariance_px))
    assert (spreads[:, 0] < 1.0).all()
    assert (spreads[:, 1] > 50.0).all()


def test_an_object_that_is_not_there_leaves_few_edges() -> None:
    rng = np.random.default_rng(3)
    tracker = EdgeTracker(MODEL)
    memory = tracker.blank()
    for t in (0.0, 0.04):
        seen = tracker.measure(drawn_image(pose(t), rng), CAMERA, pose(t), LOOSE, memory)
        memory = tracker.remember(memory, seen)
    assert tracker.measure(clutter(rng), CAMERA, pose(), LOOSE, memory).share < 0.45
    flat = np.full((CAMERA.height, CAMERA.width), 128, np.uint8)
    assert tracker.measure(flat, CAMERA, pose(), LOOSE, memory).share == 0.0


def blotched(T: FloatArray, rng: np.random.Generator, sigma_px: float) -> ImageArray:
    """The box with spots on it and around it, out of focus: spots displace its edges."""
    image = drawn_image(T, rng, clutter(rng), noise=0.0)
    corners = CAMERA.project(MODEL.corners @ T[:3, :3].T + T[:3, 3])
    for _ in range(40):
        u, v = rng.uniform(corners.min(axis=0), corners.max(axis=0)).astype(int).tolist()
        cv2.circle(image, (u, v), int(rng.uniform(3, 6)), rng.uniform(20, 230), -1)
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma_px), np.uint8)


@pytest.mark.parametrize(("sigma_px", "blur"), [(1.0, 1.0), (2.0, 1.3), (4.0, 2.5)])
def test_edges_that_blur_displaces_are_found_as_those_of_a_sharp_image(
    sigma_px: float, blur: float
) -> None:
    rng, tracker = np.random.default_rng(1), EdgeTracker(MODEL)
    for t in np.linspace(0.0, 6.0, 12):
        image, start = blotched(pose(t), rng, sigma_px), off(pose(t), rng, 0.002, 0.02)
        seen = tracker.measure(image, CAMERA, start, LOOSE, tracker.blank())
        metres, radians = pose_error(seen.T_camera_target, pose(t))
        assert seen.blur == pytest.approx(blur, rel=0.1)
        assert seen.share > 0.75
        assert metres < 0.004
        assert radians < 0.03


@pytest.mark.parametrize("sigma_px", [2.0, 4.0])
def test_an_object_that_is_not_in_a_blurred_image_leaves_few_edges(sigma_px: float) -> None:
    rng, tracker = np.random.default_rng(3), EdgeTracker(MODEL)
    for t in np.linspace(0.0, 6.0, 12):
        image = np.asarray(cv2.GaussianBlur(clutter(rng), (0, 0), sigma_px), np.uint8)
        assert tracker.measure(image, CAMERA, pose(t), LOOSE, tracker.blank()).share < 0.5


def test_out_of_the_image_nothing_is_expected() -> None:
    tracker = EdgeTracker(MODEL)
    away = pose().copy()
    away[0, 3] += 3.0
    flat = np.zeros((CAMERA.height, CAMERA.width), np.uint8)
    seen = tracker.measure(flat, CAMERA, away, LOOSE, tracker.blank())
    assert (seen.expected, len(seen.points)) == (0, 0)


def test_a_model_without_edges_cannot_be_followed() -> None:
    with pytest.raises(InputError, match="a model with edges"):
        EdgeTracker(ObjectModel.from_corners("marks", MODEL.corners))


def test_arrays_that_cannot_be_written_to_need_no_further_compilation() -> None:
    image, tracker = drawn_image(pose(), np.random.default_rng(0)), EdgeTracker(MODEL)
    arguments = [image, pose(), LOOSE.copy()]
    seen = tracker.measure(image, CAMERA, *arguments[1:], tracker.blank())
    compiled = len(measure_edges.overloads)
    for array in arguments:
        array.flags.writeable = False
    again = tracker.measure(image, CAMERA, *arguments[1:], tracker.blank())
    assert len(measure_edges.overloads) == compiled
    np.testing.assert_array_equal(again.T_camera_target, seen.T_camera_target)
