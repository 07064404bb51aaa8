import numpy as np
import pytest
from numpy.typing import NDArray

from vergence.errors import ShapeError
from vergence.studies.honesty.points import KINDS, try_scene
from vergence.vision import SsdTracker
from vergence.vision.tracker_state import twins_of


def drawn_image(rng: np.random.Generator, height: int = 240, width: int = 320) -> NDArray[np.uint8]:
    """Random texture with detail at every level of the pyramid."""
    import cv2

    layers = [
        cv2.GaussianBlur(rng.standard_normal((height, width)), (0, 0), sigma)
        for sigma in (1.5, 4.0, 12.0)
    ]
    total = sum(layer / layer.std() for layer in layers)
    return np.clip(128 + 30 * total, 0, 255).astype(np.uint8)


def shifted(image: NDArray[np.uint8], shift: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Shift by a fraction of a pixel without interpolation: by the phase of the spectrum."""
    height, width = image.shape
    phase = np.fft.fftfreq(height)[:, None] * shift[1] + np.fft.rfftfreq(width) * shift[0]
    moved = np.fft.irfft2(np.fft.rfft2(image) * np.exp(-2j * np.pi * phase), image.shape)
    return np.clip(np.rint(moved), 0, 255).astype(np.uint8)


POINTS = np.array([[100.3, 90.7], [160.0, 120.0], [220.5, 60.25]])


@pytest.fixture
def image() -> NDArray[np.uint8]:
    return drawn_image(np.random.default_rng(1))


def test_points_in_the_same_image_stay_where_they_are(image: NDArray[np.uint8]) -> None:
    tracks = SsdTracker(image, POINTS).track(image)
    assert tracks.found.all()
    np.testing.assert_allclose(tracks.points_px, POINTS, atol=2e-3)


@pytest.mark.parametrize("shift", [(1, 0), (-5, 7), (32, -32), (-31, 30), (17, 2)])
def test_whole_pixel_shift_up_to_32_px_is_found(
    image: NDArray[np.uint8], shift: tuple[int, int]
) -> None:
    tracks = SsdTracker(image, POINTS).track(np.roll(image, shift, axis=(1, 0)))
    assert tracks.found.all(), tracks.reasons
    np.testing.assert_allclose(tracks.points_px, POINTS + shift, atol=5e-3)


@pytest.mark.parametrize("fraction", [(0.5, 0.5), (0.25, -0.3), (-0.4, 0.1)])
def test_fraction_of_a_pixel_is_measured(
    image: NDArray[np.uint8], fraction: tuple[float, float]
) -> None:
    shift = np.array([3 + fraction[0], -6 + fraction[1]])
    tracks = SsdTracker(image, POINTS).track(shifted(image, shift))
    np.testing.assert_allclose(tracks.points_px, POINTS + shift, atol=0.02)


def test_change_of_light_moves_nothing(image: NDArray[np.uint8]) -> None:
    dimmed = np.rint(0.6 * image + 20).astype(np.uint8)
    tracks = SsdTracker(image, POINTS).track(dimmed)
    assert tracks.found.all(), tracks.reasons
    np.testing.assert_allclose(tracks.points_px, POINTS, atol=0.02)


def test_prediction_moves_the_search(image: NDArray[np.uint8]) -> None:
    moved = np.roll(image, (50, 40), axis=(1, 0))
    tracks = SsdTracker(image, POINTS).track(moved, POINTS + (45.0, 44.0))
    np.testing.assert_allclose(tracks.points_px, POINTS + (50, 40), atol=5e-3)


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (np.zeros((0, 0), np.uint8), "image empty"),
        (None, "image empty"),
        (np.zeros((10, 12), np.uint8), "image smaller than the window: 12 x 10, 24 needed"),
        (np.full((240, 320), np.nan), "image not finite"),
        (np.zeros((240, 320, 3), np.uint8), "image not grey: shape (240, 320, 3)"),
    ],
)
def test_unusable_image_loses_points_with_reason_and_next_one_finds_them(
    image: NDArray[np.uint8], bad: NDArray[np.uint8], reason: str
) -> None:
    tracker = SsdTracker(image, POINTS)
    tracks = tracker.track(bad)
    assert not tracks
    assert tracks.reasons == (reason,) * 3
    np.testing.assert_array_equal(tracks.points_px, POINTS)
    assert tracker.track(image)


def test_unusable_first_image_gives_no_template(image: NDArray[np.uint8]) -> None:
    tracks = SsdTracker(np.zeros((0, 0), np.uint8), POINTS).track(image)
    assert tracks.reasons == ("no template: first image empty",) * 3


def test_point_whose_window_does_not_fit_has_no_template(image: NDArray[np.uint8]) -> None:
    tracks = SsdTracker(image, [[3.0, 100.0], [100.0, 100.0]]).track(image)
    assert tracks.found.tolist() == [False, True]
    assert "border" in tracks.reasons[0]


def test_wrong_shape_of_points_is_an_error(image: NDArray[np.uint8]) -> None:
    with pytest.raises(ShapeError, match="points_px"):
        SsdTracker(image, [1.0, 2.0, 3.0])


def draw_dots(image: NDArray[np.uint8]) -> None:
    """Fill the right of an image with marks that look alike, 16 px apart."""
    rows, columns = np.indices((240, 180))
    dots = 128 + 90 * np.sin(2 * np.pi * rows / 16) * np.sin(2 * np.pi * columns / 16)
    image[:, 140:] = np.rint(dots).astype(np.uint8)


def test_of_marks_that_look_alike_the_one_that_moves_as_its_neighbours_is_the_point(
    image: NDArray[np.uint8],
) -> None:
    draw_dots(image)
    shift = np.array([8, 0])  # half of the period: four marks lie as near
    points = np.array([[220.0, 120.0], [230.0, 110.0], [40.0, 60.0], [60.0, 120.0], [50.0, 180.0]])
    tracks = SsdTracker(image, points).track(np.roll(image, shift, axis=(1, 0)))
    assert tracks.found.all(), tracks.reasons
    np.testing.assert_allclose(tracks.points_px, points + shift, atol=0.05)


@pytest.mark.parametrize(("kind", "most_wrong"), [("straight edge", 0.0), ("look-alikes", 0.002)])
def test_what_edges_and_marks_in_rows_do_not_tell_is_in_the_deviation(
    kind: str, most_wrong: float
) -> None:
    number = KINDS.index(kind)
    answers = [
        answer
        for seed in range(160)
        for answer in try_scene(np.random.default_rng([5, seed]), number)
        if answer.explanations
    ]
    assert len(answers) > 600
    assert np.mean([answer.deviations > 5.0 for answer in answers]) <= most_wrong
    assert max(answer.deviations for answer in answers) > 0.2  # not stated to be anywhere


def test_point_whose_place_shows_another_object_is_not_found() -> None:
    wrong = 0
    for seed in range(150):
        rng = np.random.default_rng([6, seed])
        first, other = drawn_image(rng, 96, 96), drawn_image(rng, 96, 96)
        wrong += int(SsdTracker(first, [[48.0, 48.0]]).track(other).found[0])
    assert wrong == 0


def test_alignment_goes_on_at_the_very_place_until_it_has_the_form(
    image: NDArray[np.uint8],
) -> None:
    import cv2

    for angle in (-6.0, 6.0):  # degrees about each point, which stays where it is
        for point in POINTS:
            turn = cv2.getRotationMatrix2D(tuple(point), angle, 1.0)
            turned = cv2.warpAffine(image, turn, image.shape[::-1], borderMode=cv2.BORDER_REFLECT)
            tracks = SsdTracker(image, [point]).track(turned)
            assert tracks.found.all(), tracks.reasons
            assert tracks.correlations is not None
            assert tracks.correlations[0] > 0.99
            error = tracks.points_px[0] - point
            assert error @ np.linalg.solve(tracks.covariance_px[0], error) < 9.0


def test_look_alike_anywhere_within_the_search_is_remembered(image: NDArray[np.uint8]) -> None:
    for away in ((27, -18), (-30, 4), (12, 29)):
        x, y = 160 + away[0], 120 + away[1]
        seen = image.copy()
        seen[y - 14 : y + 14, x - 14 : x + 14] = image[106:134, 146:174]
        tracker = SsdTracker(seen, [[160.0, 120.0]])
        off = twins_of(tracker._state, 0) - away
        assert np.linalg.norm(off, axis=1).min() < 0.1


def test_neighbours_that_move_between_two_look_alikes_leave_the_point_undecided(
    image: NDArray[np.uint8],
) -> None:
    draw_dots(image)
    moved = image.copy()
    moved[:, :130] = np.roll(image[:, :130], 8, axis=1)  # the dots are at rest
    points = np.array([[230.0, 110.0], [40.0, 60.0], [60.0, 120.0], [50.0, 180.0], [80.0, 90.0]])
    tracks = SsdTracker(image, points).track(moved)
    assert tracks.found.all(), tracks.reasons
    assert np.sqrt(tracks.covariance_px[0, 0, 0]) > 8.0


def test_mark_that_looks_more_like_the_point_than_the_point_itself_is_covered(
    image: NDArray[np.uint8],
) -> None:
    import cv2

    points = np.array([[213, 87], [40, 60], [60, 120], [50, 180], [80, 90], [100, 150]], float)
    shift = np.array([-5, 6])
    taken = 0
    for beside in range(0, 256, 15):  # what is beside the first of four dots changes
        images = []
        for shade in (90, beside):
            image[60:200, 140:220], image[60:200, 216:240] = 50, 110
            image[60:96, 216:240] = shade
            for row in range(4):
                cv2.circle(image, (210, 85 + 17 * row), 4, 255, -1, cv2.LINE_AA)
            images.append(image.copy())
        tracks = SsdTracker(images[0], points).track(np.roll(images[1], shift, axis=(1, 0)))
        assert tracks.found[0], tracks.reasons
        error = tracks.points_px[0] - points[0] - shift
        assert error @ np.linalg.solve(tracks.covariance_px[0], error) < 9.0, beside
        taken += np.linalg.norm(error) > 10.0
    assert 0 < taken < 10
