"""Corners are found where they are, with the covariance they have, or a reason is given."""

import numpy as np
import pytest
from known_scene import CAMERA, box_model, clutter, drawn_image, off, pose

from vergence.camera import Camera
from vergence.camera.lens import pack_lens, pixel_of
from vergence.errors import InputError
from vergence.geometry import transform_points
from vergence.vision.known_object import CornerExtractor, ObjectModel
from vergence.vision.known_object.projection import (
    face_table,
    hidden,
    in_camera,
    pixel_rows,
)

MODEL = box_model()
ALL = np.arange(8)
WINDOWS = np.full((8, 2), 14.0)


def seen(T: np.ndarray) -> np.ndarray:
    table = face_table(T, MODEL.surface)
    places = [in_camera(T, X) for X in MODEL.corners]
    return np.array([not hidden(table, x / z, y / z, z) for x, y, z in places])


def test_corners_are_measured_to_a_fraction_of_a_pixel_over_clutter() -> None:
    rng = np.random.default_rng(1)
    errors = []
    for t in np.linspace(0.0, 6.0, 25):
        T = pose(t)
        image = drawn_image(T, rng, clutter(rng))
        found = CornerExtractor(MODEL).measure(
            image, CAMERA, off(T, rng, 0.001, 0.01), ALL, WINDOWS
        )
        truth = CAMERA.project(transform_points(T, MODEL.corners))
        errors += list(np.linalg.norm(found.points_px - truth, axis=1)[found.found & seen(T)])
    assert len(errors) > 100
    assert np.median(errors) < 0.15
    assert np.percentile(errors, 90) < 0.5


def test_the_covariance_tells_the_error() -> None:
    rng = np.random.default_rng(2)
    squares = []
    for t in np.linspace(0.0, 6.0, 25):
        T = pose(t)
        found = CornerExtractor(MODEL).measure(
            drawn_image(T, rng, noise=4.0), CAMERA, off(T, rng, 0.0005, 0.005), ALL, WINDOWS
        )
        truth = CAMERA.project(transform_points(T, MODEL.corners))
        for n in np.flatnonzero(found.found & seen(T)):
            error = found.points_px[n] - truth[n]
            squares.append(error @ np.linalg.solve(found.covariance_px[n], error))
    assert 0.1 < np.median(squares) < 2.5  # χ² with two degrees of freedom: 1.4
    assert np.mean(np.array(squares) < 13.8) > 0.95


def test_blurred_edges_stay_in_the_middle_of_their_blur() -> None:
    rng = np.random.default_rng(3)
    T = pose()
    image = drawn_image(T, rng, blur=(7, 7), noise=0.5)
    found = CornerExtractor(MODEL).measure(image, CAMERA, T, ALL, WINDOWS)
    truth = CAMERA.project(transform_points(T, MODEL.corners))
    assert found.found[seen(T)].sum() >= 5
    assert np.linalg.norm(found.points_px - truth, axis=1)[found.found].max() < 1.5


def test_what_is_not_there_is_not_found() -> None:
    rng = np.random.default_rng(4)
    extractor = CornerExtractor(MODEL)
    flat = np.full((CAMERA.height, CAMERA.width), 128, np.uint8)
    found = extractor.measure(flat, CAMERA, pose(), ALL, WINDOWS)
    assert not found.found.any()
    assert set(np.array(found.reasons)[seen(pose())]) == {"no contrast"}
    away = pose().copy()
    away[0, 3] += 5.0
    found = extractor.measure(drawn_image(pose(), rng), CAMERA, away, ALL, WINDOWS)
    assert set(found.reasons) <= {"outside the image", "fewer than two edges seen"}
    behind = pose().copy()
    behind[2, 3] = -1.0
    assert not extractor.measure(flat, CAMERA, behind, ALL, WINDOWS).found.any()


def test_windows_are_all_that_is_looked_at() -> None:
    """Grey levels outside the windows, and the few pixels that filters need, change nothing."""
    rng = np.random.default_rng(5)
    image = drawn_image(pose(), rng)
    corner = np.flatnonzero(seen(pose()))[:1]
    windows = np.full((1, 2), 12.0)
    before = CornerExtractor(MODEL).measure(image, CAMERA, pose(), corner, windows)
    u, v = np.round(before.points_px[0]).astype(int)
    other = rng.integers(0, 255, image.shape, dtype=np.uint8)
    other[v - 32 : v + 33, u - 32 : u + 33] = image[v - 32 : v + 33, u - 32 : u + 33]
    after = CornerExtractor(MODEL).measure(other, CAMERA, pose(), corner, windows)
    np.testing.assert_array_equal(before.points_px, after.points_px)


def test_an_image_of_the_wrong_size_or_kind_is_refused() -> None:
    extractor = CornerExtractor(MODEL)
    with pytest.raises(InputError, match="64 x 48 pixels"):
        extractor.measure(np.zeros((48, 64), np.uint8), CAMERA, pose(), ALL, WINDOWS)
    with pytest.raises(InputError, match="8-bit grey"):
        extractor.measure(np.full((240, 320), np.nan), CAMERA, pose(), ALL, WINDOWS)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="a model with edges"):
        CornerExtractor(ObjectModel.from_corners("marks", MODEL.corners))


@pytest.mark.parametrize("distortion", [np.zeros(5), np.array([-0.2, 0.05, 0.001, -0.002, 0.01])])
def test_pixels_and_their_slopes_agree_with_the_camera(distortion: np.ndarray) -> None:
    camera = Camera(320, 240, 330.0, 325.0, 158.0, 121.0, distortion)
    lens, T = pack_lens(camera), pose(0.7)
    rows = np.empty((2, 6))
    for X in MODEL.corners:
        place = transform_points(T, X[None])
        u, v, z = pixel_rows(T, lens, X, rows)
        np.testing.assert_allclose((u, v), camera.project(place)[0], atol=1e-9)
        np.testing.assert_allclose(pixel_of(lens, *(place[0, :2] / z)), (u, v))
        for j in range(6):
            step = np.zeros(6)
            step[j] = 1e-6
            ends = []
            for sign in (-1.0, 1.0):
                turned = off_by(T, sign * step)
                ends.append(camera.project(transform_points(turned, X[None]))[0])
            np.testing.assert_allclose(rows[:, j], (ends[1] - ends[0]) / 2e-6, rtol=1e-3, atol=0.02)


def off_by(T: np.ndarray, step: np.ndarray) -> np.ndarray:
    from vergence.geometry import se3, so3_exp

    return se3(so3_exp(step[3:]) @ T[:3, :3], T[:3, 3] + step[:3])
