"""The mouse's hold on the target, through any of the pictures or the view in three dimensions."""

import numpy as np

from vergence.app.watch.board import Board
from vergence.app.watch.eye import Eye
from vergence.app.watch.grip import Grip
from vergence.app.watch.watched_driver import WatchedDriver
from vergence.arrays import FloatArray
from vergence.geometry import se3_inverse


class Hand:
    """Takes the target, moves it, lets go.

    Args:
        driver: of the cell.
        board: has the pictures that the mouse was in.
    """

    def __init__(self, driver: WatchedDriver, board: Board) -> None:
        self._driver, self._board = driver, board
        self._grip: Grip | None = None

    def grab(self, view: str, u: float, v: float, eye: Eye) -> None:
        """Take the target.

        Args:
            view: the camera whose picture the mouse is in; empty for the view in space.
            u: of the mouse, px; in the view in space normalized image coordinates.
            v: likewise.
            eye: from where the view in space is seen.
        """
        T_world_camera = self._seen_from(view, eye)
        if T_world_camera is None:
            return
        target = self._driver.target
        place = self._driver.world.target_pose()[:3, 3]
        depth = (se3_inverse(T_world_camera) @ np.append(place, 1.0))[2]
        start = self._normalized(view, u, v)
        self._grip = Grip(T_world_camera, float(depth), start, target.shift_m)
        target.held = True

    def move(self, view: str, u: float, v: float, along_axis: bool) -> None:
        """Move the target with the mouse; see `Grip.shift`."""
        if self._grip is not None:
            self._driver.target.shift_m = self._grip.shift(
                *self._normalized(view, u, v), along_axis
            )

    def release(self) -> None:
        """Let go: the target stays where it is."""
        self._grip = None

    def _seen_from(self, view: str, eye: Eye) -> FloatArray | None:
        if not view:
            return eye.T_world_camera
        shot = self._board.shot(view)
        return None if shot is None else shot.T_world_camera

    def _normalized(self, view: str, u: float, v: float) -> tuple[float, float]:
        if not view:
            return u, v
        x, y = self._driver.cameras[view].normalize(np.array([[u, v]]))[0].tolist()
        return x, y
