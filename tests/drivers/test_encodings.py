"""Images that robots send: every encoding gives the grey image it was made of."""

import cv2
import numpy as np
import pytest

from vergence.camera import Camera
from vergence.camera.encodings import PIXEL_BYTES, grey_image
from vergence.drivers.socket_robot import LinkBrokenError, read_image

GREY = np.tile(np.arange(0, 256, 4, dtype=np.uint8), (48, 1))  # (48, 64)
CAMERAS = {"wrist": Camera(64, 48, focal_px=60)}


def encoded(encoding: str) -> bytes:
    size = PIXEL_BYTES[encoding]
    if encoding in ("yuv422", "uyvy"):
        return np.dstack((np.full_like(GREY, 128), GREY)).tobytes()
    if encoding in ("yuv422_yuy2", "yuyv"):
        return np.dstack((GREY, np.full_like(GREY, 128))).tobytes()
    return np.repeat(GREY[:, :, None], size, axis=2).tobytes()


@pytest.mark.parametrize("encoding", PIXEL_BYTES)
def test_grey_pixels_are_the_same_in_every_encoding(encoding: str) -> None:
    image = grey_image(encoded(encoding), encoding, 64, 48)
    assert image is not None
    inner = np.s_[2:-2, 2:-2]  # a Bayer pattern says less about the edge
    assert np.abs(image[inner].astype(int) - GREY[inner]).max() <= 1


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
def test_a_compressed_image_is_that_of_its_file(suffix: str) -> None:
    block = cv2.imencode(suffix, GREY)[1].tobytes()
    image = grey_image(block, "compressed", 64, 48)
    assert image is not None
    assert np.abs(image.astype(int) - GREY).max() <= 8
    assert grey_image(block, "compressed", 64, 64) is None


@pytest.mark.parametrize("encoding", ["mono16", "compressed", "", "rgb8"])
def test_bytes_of_another_size_or_encoding_are_no_image(encoding: str) -> None:
    for block in (b"", GREY.tobytes()):
        assert grey_image(block, encoding, 64, 48) is None


def test_red_green_and_blue_are_told_apart() -> None:
    red = np.zeros((48, 64, 3), np.uint8)
    red[:, :, 0] = 255
    for encoding, level in (("rgb8", 76), ("bgr8", 29)):
        image = grey_image(red.tobytes(), encoding, 64, 48)
        assert image is not None
        assert image[0, 0] == level


@pytest.mark.parametrize(
    "about",
    [["wrist"], ["x", 1.0], ["wrist", "1"], ["wrist", 1.0, 8], ["wrist", 1.0, "x"], [1, 1.0], {}],
)
def test_an_image_that_is_told_wrongly_breaks_the_link(about: object) -> None:
    with pytest.raises(LinkBrokenError):
        read_image(about, GREY.tobytes(), CAMERAS)


def test_an_image_without_encoding_is_grey() -> None:
    for about in (["wrist", 1.5], ["wrist", 1.5, "mono8"]):
        name, time, image = read_image(about, GREY.tobytes(), CAMERAS)
        assert (name, time) == ("wrist", 1.5)
        np.testing.assert_array_equal(image, GREY)
