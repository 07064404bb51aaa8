"""The edges of an object give its pose, in any light that shows them."""

import numpy as np
import pytest
from known_scene import CAMERA, box_model, clutter, drawn_image, off, pose, pose_error

from vergence.camera.lens import pack_lens
from vergence.errors import InputError
from vergence.vision.known_object import EdgeTracker, ObjectModel
from vergence.vision.known_object.edge_samples import sample_edges
from vergence.vision.known_object.profiles import find_steps

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


def test_only_edges_that_are_seen_are_expected() -> None:
    places = np.full(12, 10)
    samples = sample_edges(
        pose(), pack_lens(CAMERA), MODEL.edges, MODEL.edge_normals, MODEL.surface, places
    )
    assert len(np.unique(samples.edge)) == 9  # of a box that shows three faces


@pytest.mark.parametrize("light", [0.35, 1.0])
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
