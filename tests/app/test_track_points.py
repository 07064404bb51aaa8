"""`vg.track_points` follows points through a folder, and says what it cannot follow."""

from pathlib import Path

import cv2
import numpy as np
import pytest

import vergence as vg
from vergence.places import CELLS


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five images of a texture that moves by (3, 2) pixels from one to the next."""
    folder = tmp_path_factory.mktemp("frames")
    texture = cv2.imread(str(CELLS / "puma560/leaves.png"), cv2.IMREAD_GRAYSCALE)
    for k in range(5):
        moved = np.roll(texture, (2 * k, 3 * k), axis=(0, 1))[:240, :320]
        cv2.imwrite(str(folder / f"{k}.png"), moved)
    return folder


def test_picked_points_move_as_the_images_do(frames: Path) -> None:
    tracked = list(vg.track_points(frames, count=8, rate_hz=10.0))
    assert [round(frame.time, 3) for frame, _ in tracked] == [0.0, 0.1, 0.2, 0.3, 0.4]
    first, last = tracked[0][1], tracked[-1][1]
    assert last.found.all()
    assert len(last.found) == 8
    np.testing.assert_allclose(last.points_px - first.points_px, [[12.0, 8.0]] * 8, atol=0.1)


def test_points_may_be_given_and_the_tracker_named(frames: Path) -> None:
    given = [[150.0, 150.0], [90.0, 100.0]]
    for _, points in vg.track_points(frames, points_px=given, tracker={"kind": "ssd"}):
        assert points.points_px.shape == (2, 2)
    with pytest.raises(vg.InputError, match="did you mean ssd"):
        next(vg.track_points(frames, tracker="sdd"))
    with pytest.raises(vg.InputError, match="no corner of a marker"):
        next(vg.track_points(frames, points_px=given, tracker="tags"))


def test_images_that_show_nothing_are_refused(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "0.png"), np.full((240, 320), 90, np.uint8))
    with pytest.raises(vg.InputError, match="an image with texture"):
        next(vg.track_points(tmp_path))
    with pytest.raises(vg.InputError, match="no such folder"):
        next(vg.track_points(tmp_path / "none"))
