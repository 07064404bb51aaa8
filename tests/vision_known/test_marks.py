"""Marks are found to a fraction of a pixel, or a reason is given."""

import cv2
import numpy as np
import pytest

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.errors import InputError
from vergence.vision.marks import (
    MarkerDetector,
    TagTracking,
    circle_centre_bias,
    measure_round_marks,
)
from vergence.vision.marks.tag_corners import refined_corners

CAMERA = Camera(320, 240, 400.0, 400.0, 159.5, 119.5)
FINE = 8


def disc(
    centre: tuple[float, float], radius: float, mark: int = 30, ground: int = 200
) -> ImageArray:
    v, u = np.mgrid[: 80 * FINE, : 80 * FINE]
    u, v = (u + 0.5) / FINE - 0.5, (v + 0.5) / FINE - 0.5
    inside = (u - centre[0]) ** 2 + (v - centre[1]) ** 2 < radius**2
    fine = np.where(inside, mark, ground).astype(np.float64)
    return np.rint(fine.reshape(80, FINE, 80, FINE).mean(axis=(1, 3))).astype(np.uint8)


def bent() -> ImageArray:
    """A mark with the shape of an L."""
    image = np.full((80, 80), 20, np.uint8)
    image[20:42, 34:38] = image[38:42, 34:50] = 210
    return image


def circle_image(centre: FloatArray, normal: FloatArray, radius: float) -> FloatArray:
    """Centroid of the image of a circle, by sampling its disc's rim."""
    n = normal / np.linalg.norm(normal)
    a = np.cross(n, [0.0, 1.0, 0.0])
    a /= np.linalg.norm(a)
    b = np.cross(n, a)
    angle = np.linspace(0.0, 2 * np.pi, 4000, endpoint=False)[:, None]
    rim = CAMERA.project(centre + radius * (np.cos(angle) * a + np.sin(angle) * b))
    x, y = rim.T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    area = cross.sum() / 2
    return np.array(
        [
            ((x + np.roll(x, -1)) * cross).sum() / (6 * area),
            ((y + np.roll(y, -1)) * cross).sum() / (6 * area),
        ]
    )


@pytest.mark.parametrize(("mark", "ground"), [(30, 200), (220, 40)])
@pytest.mark.parametrize("radius", [3.0, 7.5, 12.0])
def test_the_centroid_is_the_centre(mark: int, ground: int, radius: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(5):
        centre = tuple(rng.uniform(38, 42, 2))
        image = disc(centre, radius, mark, ground)
        image = np.clip(image + rng.normal(0, 2, image.shape), 0, 255).astype(np.uint8)
        found = measure_round_marks(image, np.array([[39.0, 41.0]]), np.array([[22.0, 22.0]]))
        assert found.found[0]
        assert np.linalg.norm(found.points_px[0] - centre) < 0.12
        assert found.area_px[0] == pytest.approx(np.pi * radius**2, rel=0.1)


@pytest.mark.parametrize(
    ("image", "reason"),
    [
        (np.full((80, 80), 99, np.uint8), "no contrast"),
        (disc((40.0, 12.0), 14.0), "no mark near the prediction"),
        (bent(), "not round"),
    ],
)
def test_a_mark_that_is_none_has_a_reason(image: np.ndarray, reason: str) -> None:
    middle = np.array([[40.0, 30.0]])
    found = measure_round_marks(image, middle, np.array([[20.0, 20.0]]))
    assert not found.found[0]
    assert found.reasons[0] == reason
    np.testing.assert_array_equal(found.points_px, middle)


def test_a_thin_ring_that_noise_makes_is_no_mark() -> None:
    """No pixel is well inside of it, and none in its box well outside."""
    image = np.zeros((17, 16), np.uint8)
    image[16, 0] = 195  # so that the middle of dark and bright is 97.5
    image[:6, 11:] = [
        [90, 110, 90, 0, 0],
        [110, 90, 110, 0, 0],
        [110, 90, 110, 110, 90],
        [110, 90, 90, 90, 110],
        [90, 110, 90, 110, 90],
        [0, 90, 110, 90, 0],
    ]
    found = measure_round_marks(image, np.array([[7.5, 8.0]]), np.full((1, 2), 60.0))
    assert not found.found[0]


def test_a_mark_outside_the_image_is_told() -> None:
    found = measure_round_marks(disc((40, 40), 5), np.array([[-4.0, 5.0]]), np.array([[9.0, 9.0]]))
    assert found.reasons == ("outside the image",)


def test_the_bias_of_a_slanted_circle_is_known() -> None:
    centre, normal = np.array([0.05, -0.03, 0.4]), np.array([0.6, 0.3, -1.0])
    true_centre = CAMERA.project(centre[None])[0]
    bias = circle_image(centre, normal, 0.03) - true_centre
    assert np.linalg.norm(bias) > 0.3
    np.testing.assert_allclose(circle_centre_bias(CAMERA, centre, normal, 0.03), bias, atol=1e-3)


def test_a_circle_that_faces_the_camera_has_no_bias() -> None:
    bias = circle_centre_bias(CAMERA, np.array([0.0, 0.0, 0.4]), np.array([0.0, 0.0, -1.0]), 0.03)
    np.testing.assert_allclose(bias, 0.0, atol=1e-9)


def marker_image(number: int, quad: FloatArray) -> ImageArray:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    side = 400
    tag = np.full((side + 200, side + 200), 255, np.uint8)
    tag[100:-100, 100:-100] = cv2.aruco.generateImageMarker(dictionary, number, side)
    # Corners of the black square, where pixel centres are at integers.
    square = np.array([[100, 100], [500, 100], [500, 500], [100, 500]], np.float32) - 0.5
    fine = (quad + 0.5) * 4 - 0.5
    H = cv2.getPerspectiveTransform(square, fine.astype(np.float32))
    big = cv2.warpPerspective(tag, H, (1280, 960), borderValue=180)
    return cv2.resize(big, (320, 240), interpolation=cv2.INTER_AREA)


QUAD = np.array([[110.3, 60.2], [201.7, 72.4], [195.1, 160.8], [104.6, 151.3]])


def test_a_marker_is_found_with_its_number_and_corners() -> None:
    found = MarkerDetector("apriltag_36h11").detect(marker_image(7, QUAD))
    assert found.ids.tolist() == [7]
    assert np.linalg.norm(found.corners_px[0] - QUAD, axis=1).max() < 0.5
    assert found.covariance_px.shape == (1, 4, 2, 2)


@pytest.mark.parametrize("light", [0.2, 0.07])
def test_a_marker_in_the_dark_is_found(light: float) -> None:
    dark = light * marker_image(23, QUAD) + np.random.default_rng(0).normal(0, 1.5, (240, 320))
    marks = MarkerDetector("apriltag_36h11").detect(np.clip(np.rint(dark), 0, 255).astype(np.uint8))
    assert marks.ids.tolist() == [23]
    np.testing.assert_allclose(marks.corners_px[0], QUAD, atol=0.6)


@pytest.mark.parametrize(("focus_px", "most_px"), [(0.0, 0.03), (2.0, 0.12), (3.0, 0.25)])
@pytest.mark.parametrize("gamma", [1.0, 2.2])
def test_blur_does_not_draw_corners_to_what_lies_next_to_them(
    focus_px: float, most_px: float, gamma: float
) -> None:
    """Blur reaches the cells next to the border, and a camera's gamma widens what is white."""
    light = 0.05 + 0.8 * marker_image(7, QUAD) / 255.0
    blurred = cv2.GaussianBlur(light, (0, 0), focus_px) if focus_px else light
    seen = 255.0 * blurred ** (1.0 / gamma) + np.random.default_rng(0).normal(0, 1.0, light.shape)
    image = np.clip(np.rint(seen), 0, 255).astype(np.uint8)
    marks = MarkerDetector("apriltag_36h11").detect(image)
    assert marks.ids.tolist() == [7]
    off = marks.corners_px[0] - QUAD
    assert np.linalg.norm(off, axis=1).max() < most_px
    squares = np.einsum("ni,nij,nj->n", off, np.linalg.inv(marks.covariance_px[0]), off)
    assert squares.max() < 9.0


@pytest.mark.parametrize("shift", [0.0, 0.25, 0.47, 0.5])
def test_a_sharp_image_without_noise_is_not_left_out_along_the_edges(shift: float) -> None:
    """All residuals are at the edges then, and must not pass for outliers."""
    square = np.array([[109.0, 59.0], [209.0, 59.0], [209.0, 159.0], [109.0, 159.0]]) + shift
    marks = MarkerDetector("apriltag_36h11").detect(marker_image(7, square))
    assert np.linalg.norm(marks.corners_px[0] - square, axis=1).max() < 0.05


def test_a_marker_that_is_partly_covered_keeps_its_corners() -> None:
    image = marker_image(7, QUAD)
    image[95:115, 150:158] = 255
    marks = MarkerDetector("apriltag_36h11").detect(image)
    assert marks.ids.tolist() == [7]
    assert np.linalg.norm(marks.corners_px[0] - QUAD, axis=1).max() < 0.1


def test_corners_that_the_marker_does_not_fit_are_uncertain_by_half_a_cell() -> None:
    cells = np.pad(np.eye(6), 1)
    noise = np.random.default_rng(0).integers(0, 255, (240, 320), np.uint8)
    corners, covariance = refined_corners(noise, QUAD, cells, 0.05)
    np.testing.assert_array_equal(corners, QUAD)
    assert np.sqrt(covariance[:, 0, 0]).min() > 5.0


def test_a_marker_far_out_of_focus_is_found_once_and_says_how_uncertain_its_corners_are() -> None:
    blurred = cv2.GaussianBlur(marker_image(23, QUAD), (0, 0), 4.0)
    marks = MarkerDetector("apriltag_36h11").detect(blurred)
    assert marks.ids.tolist() == [23]
    off = marks.corners_px[0] - QUAD
    squares = np.einsum("ni,nij,nj->n", off, np.linalg.inv(marks.covariance_px[0]), off)
    assert squares.max() < 9.0


def test_a_window_keeps_the_pixels_of_the_image() -> None:
    detector, image = MarkerDetector("apriltag_36h11"), marker_image(7, QUAD)
    whole, part = detector.detect(image), detector.detect(image, (80, 40, 230, 190))
    np.testing.assert_allclose(part.corners_px, whole.corners_px, atol=0.05)
    assert len(detector.detect(image, (300, 40, 300, 190)).ids) == 0
    assert len(detector.detect(image[:, :100]).ids) == 0


def test_corners_of_markers_are_followed_by_their_numbers() -> None:
    moved = QUAD + (30.0, 20.0)
    tracker = TagTracking().start(marker_image(7, QUAD), QUAD[[2, 0]] + 3.0)
    tracks = tracker.track(marker_image(7, moved))
    assert tracks.found.all()
    np.testing.assert_allclose(tracks.points_px, moved[[2, 0]], atol=0.5)
    other = tracker.track(marker_image(8, moved))  # another marker in the same place
    assert not other.found.any()
    assert other.reasons == ("marker 7 is not seen",) * 2
    np.testing.assert_array_equal(other.points_px, tracks.points_px)  # where they were last


def test_points_without_a_marker_are_refused() -> None:
    with pytest.raises(InputError, match=r"no corner of a marker within 10 px of \(20, 30\)"):
        TagTracking().start(marker_image(7, QUAD), np.array([[20.0, 30.0]]))
    with pytest.raises(InputError, match="allowed: apriltag_36h11"):
        TagTracking(dictionary="apriltag36h11")


def test_a_dictionary_that_is_not_known_is_answered_with_those_that_are() -> None:
    with pytest.raises(InputError, match="allowed: apriltag_36h11"):
        MarkerDetector("apriltag36h11")
