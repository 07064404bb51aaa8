"""The film of the robot in a report shows the run from outside, in few small images."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from vergence.app.first_view import first_view, points_in_view
from vergence.app.recorded_images import MarkedImage
from vergence.app.report import make_report
from vergence.app.robot_film import robot_film
from vergence.app.watch.viewer_camera import ViewerCamera
from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.runtime.recording import Recorder, Recording
from vergence.simulation.cell_model import CellModel


@pytest.fixture(scope="module")
def fast(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """A Puma that follows a fast board for a second."""
    folder: Path = tmp_path_factory.mktemp("film")
    speed = {"duration_s": "1.0", "target.motion.velocity_m_s": "[0.4, 0.0, 0.0]"}
    run_cell(load_cell("puma560", speed), [Recorder(folder)], images=False)
    return Recording.open(folder)


def pixels(frame: MarkedImage) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(frame.jpeg, np.uint8), cv2.IMREAD_GRAYSCALE).astype(int)


def test_the_film_goes_evenly_over_the_run_and_shows_motion(fast: Recording) -> None:
    film = robot_film(fast)
    np.testing.assert_allclose([f.time for f in film], np.linspace(0, fast.duration, len(film)))
    assert 2 < len(film) <= 24
    assert max(len(frame.jpeg) for frame in film) < 40_000
    first, last = pixels(film[0]), pixels(film[-1])
    moved = np.abs(first - last) > 40
    assert 0.005 < moved.mean() < 0.2  # the arm and the board, not the view
    assert "The cell from outside" in make_report(fast)


def test_a_run_whose_cell_is_not_here_has_no_film(recording: Recording) -> None:
    assert robot_film(recording) == ()


def test_no_wall_is_between_the_eye_and_the_arms() -> None:
    world = CellModel(load_cell("lippiello2005"))
    points = points_in_view(world)
    camera = first_view(world, points)
    eye = ViewerCamera.around(
        camera.lookat, camera.distance, camera.azimuth, camera.elevation, 45.0
    ).T_world_camera[:3, 3]
    hidden = [world.ray(eye, (point - eye) / np.linalg.norm(point - eye)) for point in points]
    far = np.linalg.norm(points - eye, axis=1)
    by_wall = [
        body == 0 and met < 0.9 * away for (met, body), away in zip(hidden, far, strict=True)
    ]
    assert not any(by_wall)
