"""Images and videos as cameras and people leave them."""

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from vergence.app.tracking.footage import open_footage
from vergence.errors import InputError

RAMP = np.tile(np.arange(0, 256, dtype=np.uint16), (64, 1))


def images(folder: Path) -> list[np.ndarray]:
    return [frame.image for frame in open_footage(folder).frames()]


def test_images_come_in_the_natural_order_of_their_names(tmp_path: Path) -> None:
    for number in range(1, 13):
        cv2.imwrite(str(tmp_path / f"img{number}.png"), np.full((30, 40), number, np.uint8))
    (tmp_path / "._img3.png").write_bytes(b"what a Mac leaves beside a file")
    assert [int(image[0, 0]) for image in images(tmp_path)] == list(range(1, 13))


@pytest.mark.parametrize("bits", [8, 10, 12, 14, 16])
def test_an_image_of_any_depth_in_sixteen_bits_spreads_over_all_grey_levels(
    tmp_path: Path, bits: int
) -> None:
    cv2.imwrite(str(tmp_path / "0.png"), RAMP << (bits - 8))
    (image,) = images(tmp_path)
    assert image.min() == 0
    assert image.max() >= 254
    assert np.abs(image.astype(int) - RAMP).max() <= 1


def test_images_of_one_folder_have_one_scale_however_dark_some_are(tmp_path: Path) -> None:
    for number, brightness in enumerate((4, 1, 16)):
        cv2.imwrite(str(tmp_path / f"{number}.png"), RAMP * np.uint16(brightness))
    dark, darker, bright = images(tmp_path)
    np.testing.assert_allclose(dark, RAMP * (4 / 16.06), atol=0.51)
    np.testing.assert_allclose(darker, RAMP * (1 / 16.06), atol=0.51)
    np.testing.assert_allclose(bright, RAMP * (16 / 16.06), atol=0.51)


@pytest.mark.parametrize("white", [1.0, 255.0, 4095.0])
def test_float_images_are_scaled_by_their_usual_white(tmp_path: Path, white: float) -> None:
    cv2.imwrite(str(tmp_path / "0.tiff"), (RAMP / 255.0 * white).astype(np.float32))
    (image,) = images(tmp_path)
    np.testing.assert_array_equal(image, RAMP)


def test_an_opaque_alpha_channel_changes_nothing(tmp_path: Path) -> None:
    grey = RAMP.astype(np.uint8)
    cv2.imwrite(str(tmp_path / "0.png"), np.dstack([grey] * 3 + [np.full_like(grey, 255)]))
    np.testing.assert_array_equal(images(tmp_path)[0], grey)


def png(width: int, height: int) -> bytes:
    """A black PNG, however large, in a small file."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    header = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    pixels = zlib.compress(bytes(width // 8 + 1) * height)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")
    )  # fmt: skip


def encoded(kind: str, image: np.ndarray) -> bytes:
    return bytes(cv2.imencode(kind, image)[1])


GREY = np.random.default_rng(0).integers(0, 256, (200, 200), dtype=np.uint8)
CLEAR = np.dstack([GREY, GREY, GREY, np.zeros_like(GREY)])


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("b.png", png(12_000, 12_000), "given 12000 x 12000 pixels; allowed: at most 100 mega"),
        ("b.png", png(30_000, 30_000), "more than 178 megapixels"),
        ("b.png", encoded(".png", GREY)[:-200], "a file that cannot be read"),
        ("b.png", b"no image", "a file that cannot be read"),
        ("b.png", b"", "a file that cannot be read"),
        ("b.jpg", encoded(".jpg", GREY)[:9000], "an image that is cut off"),
        ("b.png", encoded(".png", CLEAR), "transparent pixels"),
        ("b.png", encoded(".png", GREY[:100]), "200 x 100 pixels; allowed: 200 x 200"),
        ("b.png", encoded(".png", GREY.astype(np.uint16) << 8), "uint16 values; allowed: uint8"),
        ("b.tiff", encoded(".tiff", GREY.astype(np.int16)), "values of kind int16"),
        ("b.tiff", encoded(".tiff", GREY / np.float32(np.nan)), "not finite"),
    ],
)
def test_an_image_that_cannot_be_used_is_named_before_it_takes_memory(
    tmp_path: Path, name: str, content: bytes, words: str
) -> None:
    cv2.imwrite(str(tmp_path / "a.png"), GREY)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as caught:
        images(tmp_path)
    assert words in str(caught.value)
    assert caught.value.source == str(tmp_path / name)


def write_video(path: Path, stamps_ms: list[int]) -> None:
    """Write a Matroska video whose images have these time stamps, in its only cluster."""
    code = cv2.VideoWriter.fourcc(*"VP80")
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, 10.0, (64, 48))
    for number in range(len(stamps_ms)):
        writer.write(np.full((48, 64, 3), 20 * number, np.uint8))
    writer.release()
    raw, place = bytearray(path.read_bytes()), 0
    for number, stamp in enumerate(stamps_ms):
        usual = struct.pack(">h", 100 * number)
        place = raw.index(b"\x81" + usual, raw.index(b"\xa3", place)) + 1  # of a SimpleBlock
        raw[place : place + 2] = struct.pack(">h", stamp)
    path.write_bytes(raw)


def test_a_videos_own_time_stamps_count(tmp_path: Path) -> None:
    stamps = [0, 100, 150, 400, 420, 900, 1000, 1500]
    write_video(tmp_path / "video.mkv", stamps)
    frames = list(open_footage(tmp_path / "video.mkv").frames())
    np.testing.assert_allclose([p.time for p in frames], np.array(stamps) / 1e3, atol=1e-9)
    assert [round(p.image.mean() / 20) for p in frames] == list(range(8))


def test_a_rate_that_is_given_replaces_a_videos_time_stamps(tmp_path: Path) -> None:
    write_video(tmp_path / "video.mkv", [0, 100, 150, 400])
    frames = open_footage(tmp_path / "video.mkv", rate_hz=50.0).frames()
    np.testing.assert_allclose([p.time for p in frames], [0.0, 0.02, 0.04, 0.06], atol=1e-12)


def test_time_never_runs_backwards_in_a_video(tmp_path: Path) -> None:
    write_video(tmp_path / "video.mkv", [0, 100, 100, 300])
    frames = open_footage(tmp_path / "video.mkv").frames()
    assert np.diff([p.time for p in frames]).min() > 0.0
