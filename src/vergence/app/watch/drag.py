"""How a mouse in an image, or in the view in three dimensions, drags the target."""

from dataclasses import dataclass

import numpy as np

from vergence.app.watch.view_state import ViewState
from vergence.app.watch.viewer_camera import ViewerCamera
from vergence.app.watch.watched_driver import WatchedDriver
from vergence.arrays import FloatArray
from vergence.errors import InputError, nearest
from vergence.geometry import se3_inverse


@dataclass(frozen=True, slots=True)
class Drag:
    """A point that the mouse drags, seen from where the camera was when it was taken.

    The camera's pose stays that of the moment: the arm that follows would otherwise carry the
    image, and with it the target, away from under a mouse that rests.
    """

    T_world_camera: FloatArray  # (4, 4) when it was taken
    depth_m: float  # of the point along the optical axis
    start: tuple[float, float]  # of the mouse, normalized image coordinates
    shift_m: FloatArray  # (3,) of the point in the world, before

    def shift(self, x: float, y: float, along_axis: bool) -> FloatArray:
        """Return where the mouse puts the point, (3,), as a shift in the world.

        Args:
            x: of the mouse, normalized image coordinates.
            y: likewise; below the optical axis it is positive.
            along_axis: whether the mouse moves it away (up) and nearer (down) instead of across.
        """
        across = self.depth_m * np.array([x - self.start[0], y - self.start[1], 0.0])
        moved = np.array([0.0, 0.0, -across[1]]) if along_axis else across
        shifted: FloatArray = self.shift_m + self.T_world_camera[:3, :3] @ moved
        return shifted


class TargetDrag:
    """Takes the target, moves it, releases it.

    Args:
        driver: of the cell.
        view_state: has the images that the mouse was in.
    """

    def __init__(self, driver: WatchedDriver, view_state: ViewState) -> None:
        self._driver, self._view_state = driver, view_state
        self._drag: Drag | None = None

    def grab(self, view: str, u: float, v: float, viewer_camera: ViewerCamera) -> None:
        """Take the target.

        Args:
            view: the camera whose image the mouse is in; empty for the view in three dimensions.
            u: of the mouse, px; in the view in three dimensions normalized image coordinates.
            v: likewise.
            viewer_camera: from where the view in three dimensions is seen.

        Raises:
            InputError: if there is no such camera.
        """
        start = self._normalized(view, u, v)
        T_world_camera = self._seen_from(view, viewer_camera)
        if T_world_camera is None:
            return
        target = self._driver.target
        place = self._driver.world.target_pose()[:3, 3]
        depth = (se3_inverse(T_world_camera) @ np.append(place, 1.0))[2]
        self._drag = Drag(T_world_camera, float(depth), start, target.shift_m)
        target.held = True

    def move(self, view: str, u: float, v: float, along_axis: bool) -> None:
        """Move the target with the mouse; see `Drag.shift`.

        Raises:
            InputError: if there is no such camera.
        """
        if self._drag is not None:
            x, y = self._normalized(view, u, v)
            self._driver.target.shift_m = self._drag.shift(x, y, along_axis)

    def release(self) -> None:
        """Leave the target where it is."""
        self._drag = None

    def _seen_from(self, view: str, viewer_camera: ViewerCamera) -> FloatArray | None:
        if not view:
            return viewer_camera.T_world_camera
        shown = self._view_state.view(view)
        return None if shown is None else shown.T_world_camera

    def _normalized(self, view: str, u: float, v: float) -> tuple[float, float]:
        if not view:
            return u, v
        camera = self._driver.cameras.get(view)
        if camera is None:
            raise InputError("message", "view", view, nearest(view, self._driver.cameras))
        x, y = camera.normalize(np.array([[u, v]]))[0].tolist()
        return x, y
