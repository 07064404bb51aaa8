"""`vergence track --tag`: a tag is found by its number, followed, and never taken for another."""

import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from vergence.app.main import main
from vergence.app.tracking.tag_follower import TagFollower, tag_of_option
from vergence.camera import Camera
from vergence.estimation.known_object.object_follower import Sighting
from vergence.geometry import se3, so3_exp, so3_log
from vergence.simulation.tag_plate import tag_image
from vergence.vision.marks import MarkerDetector, OneTag, one_tag

CAMERA = Camera(640, 480, 700.0, 700.0, 319.5, 239.5)
TAG = tag_of_option("apriltag_36h11:7:0.05")


def pose(k: int) -> np.ndarray:
    turn = so3_exp(np.array([0.3, 0.05 * k - 0.3, 0.04 * k]))
    return se3(so3_exp(np.array([np.pi, 0.0, 0.0])) @ turn, np.array([0.002 * k, -0.01, 0.3]))


def image(T: np.ndarray) -> np.ndarray:
    """Return the tag as the camera sees it at a pose, on grey."""
    texture, bits = tag_image(TAG)
    half = 0.5 * TAG.size_m * (bits + 2) / bits
    side = texture.shape[0]
    corners = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
    seen = CAMERA.project(corners @ T[:3, :3].T + T[:3, 3]) + 0.5
    ends = np.array([[0, 0], [side, 0], [side, side], [0, side]])
    H = cv2.getPerspectiveTransform(ends.astype(np.float32), 4 * seen.astype(np.float32))
    size = (4 * 640, 4 * 480)
    to_centres = np.array([[1, 0, -0.5], [0, 1, -0.5], [0, 0, 1.0]])
    warp = to_centres @ H @ np.linalg.inv(to_centres)
    drawn = cv2.warpPerspective(texture, warp, size, borderValue=128.0)
    return cv2.resize(drawn, (640, 480), interpolation=cv2.INTER_AREA)


def test_its_pose_is_right_and_its_covariance_honest() -> None:
    follower = TagFollower(TAG, CAMERA)
    for k in range(12):
        step = follower.follow(image(pose(k)), k / 10)
        assert step.sighting is Sighting.SEEN, step.reason
        T = step.T_camera_target
        turn = so3_log(np.ascontiguousarray(T[:3, :3] @ pose(k)[:3, :3].T))
        off = np.concatenate((T[:3, 3] - pose(k)[:3, 3], turn))
        assert np.linalg.norm(off[:3]) < 1e-3
        assert np.linalg.norm(turn) < np.deg2rad(0.7)
        assert off @ np.linalg.solve(step.covariance[:6, :6], off) < 40.0


def test_it_is_found_again_wherever_it_comes_back() -> None:
    follower = TagFollower(TAG, CAMERA)
    nothing = np.full((480, 640), 128, np.uint8)
    seen = [follower.follow(image(pose(0)), 0.0)]
    seen += [follower.follow(nothing, k / 30) for k in range(1, 60)]
    back = pose(3)
    back[0, 3] -= 0.06
    seen += [follower.follow(image(back), k / 30) for k in range(60, 63)]
    assert seen[1].sighting is Sighting.PREDICTED
    assert seen[1].reason == "marker 7 is not seen"
    assert seen[59].sighting is Sighting.LOST
    assert seen[-1].sighting is Sighting.SEEN
    assert np.linalg.norm(seen[-1].T_camera_target[:3, 3] - back[:3, 3]) < 1e-3


def test_what_is_seen_instead_is_told() -> None:
    other = tag_of_option("aruco_4x4_50:8:0.05")
    step = TagFollower(other, CAMERA).follow(image(pose(0)), 0.0)
    assert step.sighting is Sighting.LOST
    assert "it shows marker 7 of apriltag_36h11" in step.reason


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--tag", "apriltag_36h11:7"], "DICTIONARY:ID:SIZE"),
        (["--tag", "apriltag_36h11:700:0.05"], "0 to 586 in apriltag_36h11"),
        (["--tag", "circle49h12:7:0.05"], "a family of AprilTag 3 that OpenCV does not find"),
        (["--tag", "apriltag_36h11:7:0"], "size_m: given 0.0; allowed: at least 0.001"),
        (["--tag", "apriltag_36h11:7:0.05", "--model", "a.obj"], "only without --tag"),
        (["--model", "a.obj"], "--start: missing"),
        ([], "--model with --start, --tag, or --curve"),
    ],
)
def test_bad_options_are_named(
    options: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: object
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["vergence", "track", str(tmp_path), *options])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert words in capsys.readouterr().err  # type: ignore[attr-defined]


def test_an_image_is_searched_once_whatever_is_asked_of_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    searched = []

    def counted(detector: MarkerDetector, grey: np.ndarray, number: int) -> OneTag | str:
        searched.append(grey)
        return one_tag(detector, grey, number)

    monkeypatch.setattr("vergence.assembly.tag.one_tag", counted)
    follower = TagFollower(TAG, CAMERA)
    nothing = np.full((480, 640), 128, np.uint8)
    images = [image(pose(0)), image(pose(1)), nothing, image(pose(3))]
    for k, shown in enumerate(images):
        follower.follow(shown, k / 30)
    assert len(searched) == len(images)
    assert all(map(np.array_equal, searched, images))
