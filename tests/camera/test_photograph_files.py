"""Photographs and what is kept beside them."""

import cv2
import numpy as np
import pytest
from PIL import Image

from vergence.camera import Camera
from vergence.camera.photograph import read_photograph, write_photograph
from vergence.errors import InputError

CAMERA = Camera(320, 240, focal_px=300)


def texture(camera):
    """Return an image that is a smooth function of the direction of sight."""
    v, u = np.indices((camera.height, camera.width))
    x, y = camera.normalize(np.column_stack((u.ravel(), v.ravel())).astype(float)).T
    grey = 128 + 50 * np.sin(20 * x) + 50 * np.cos(25 * y)
    return grey.reshape(camera.height, camera.width).astype(np.uint8)


def test_what_is_written_is_read_again(tmp_path):
    path = tmp_path / "goal.png"
    write_photograph(path, texture(CAMERA), CAMERA, {"arm": np.array([1.0, -2.5])}, 0.4)
    found = read_photograph(path, CAMERA)
    np.testing.assert_array_equal(found.image, texture(CAMERA))
    assert found.shown is None
    assert found.distance_m == 0.4
    np.testing.assert_allclose(found.joints_deg["arm"], [1.0, -2.5])


@pytest.mark.parametrize(
    "lens",
    [
        Camera(640, 480, focal_px=700),
        Camera(500, 500, focal_px=260, distortion=(-0.1, 0.02, 0.0, 0.0, 0.0)),
    ],
)
def test_a_photograph_by_another_camera_is_seen_as_by_the_arms(tmp_path, lens):
    path = tmp_path / "phone.png"
    write_photograph(path, texture(lens), lens, {})
    found = read_photograph(path, CAMERA)
    shown = np.ones((240, 320), bool) if found.shown is None else found.shown
    shown = cv2.erode(shown.astype(np.uint8), np.ones((5, 5))) > 0
    difference = np.abs(found.image.astype(int) - texture(CAMERA))[shown]
    assert shown.mean() > 0.5
    assert difference.max() <= 6
    corner = np.array([[100.0, 90.0]])
    there = found.in_image(corner, CAMERA)
    back = CAMERA.normalize(there)
    np.testing.assert_allclose(back, lens.normalize(corner), atol=1e-9)


def test_the_focal_length_may_come_from_exif(tmp_path):
    lens = Camera(640, 480, focal_px=27.0 / np.hypot(36, 24) * np.hypot(640, 480))
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 27
    path = tmp_path / "phone.jpg"
    Image.fromarray(texture(lens)).save(path, exif=exif, quality=95)
    found = read_photograph(path, CAMERA).lens
    np.testing.assert_allclose(found.matrix, lens.matrix)


def test_a_photograph_by_nobody_knows_which_camera_is_refused(tmp_path):
    path = tmp_path / "phone.png"
    cv2.imwrite(str(path), texture(Camera(640, 480, focal_px=700)))
    with pytest.raises(InputError, match=r"640 x 480.*phone\.camera\.yaml"):
        read_photograph(path, CAMERA)


@pytest.mark.parametrize(
    ("notes", "word"),
    [
        ("distance_m = -1.0", "above zero"),
        ("joints_deg = 3", "table of lists"),
        ("distance = 1.0", "distance_m"),
        ("distance_m = [", "goal.toml"),
    ],
)
def test_notes_that_cannot_be_used_are_refused_by_name(tmp_path, notes, word):
    path = tmp_path / "goal.png"
    cv2.imwrite(str(path), texture(CAMERA))
    (tmp_path / "goal.toml").write_text(notes)
    with pytest.raises(InputError, match=word):
        read_photograph(path, CAMERA)
