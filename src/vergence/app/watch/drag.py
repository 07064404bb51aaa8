"""How a mouse in an image, or in the view in three dimensions, drags the target."""

from dataclasses import dataclass, replace

import numpy as np

from vergence.app.watch.view_state import ViewState
from vergence.app.watch.viewer_camera import ViewerCamera
from vergence.app.watch.watched_driver import WatchedDriver
from vergence.arrays import FloatArray
from vergence.errors import InputError, nearest
from vergence.geometry import se3_inverse, so3_angle, so3_exp, so3_log

_RAD_PER_FOCAL = 3.0  # by how much the target turns as the mouse goes one focal length


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
    turn_rad: FloatArray  # (3,) of the target, likewise

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

    def turn(self, x: float, y: float, about_axis: bool) -> FloatArray:
        """Return how the mouse turns the target, (3,), a rotation vector in the world.

        Args:
            x: as for `shift`; the near side of the target follows the mouse.
            y: likewise.
            about_axis: whether it is turned about the optical axis instead.
        """
        dx, dy = _RAD_PER_FOCAL * (x - self.start[0]), _RAD_PER_FOCAL * (y - self.start[1])
        turned = np.array([0.0, 0.0, dx]) if about_axis else np.array([dy, -dx, 0.0])
        R: FloatArray = so3_exp(self.T_world_camera[:3, :3] @ turned) @ so3_exp(self.turn_rad)
        return so3_log(R)


class TargetDrag:
    """Takes the target, moves it, releases it.

    Args:
        driver: of the cell.
        view_state: has the images that the mouse was in.
    """

    def __init__(self, driver: WatchedDriver, view_state: ViewState) -> None:
        self._driver, self._view_state = driver, view_state
        self._drag: Drag | None = None
        self._taken: Drag | None = None  # when it was taken, for what is said at the end
        self._keys = (False, False)  # of the last move: along the axis, turning
        self._last = (0.0, 0.0)  # where the mouse was then, normalized image coordinates

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
        self._drag = Drag(T_world_camera, float(depth), start, target.shift_m, target.turn_rad)
        self._taken, self._last = self._drag, start
        target.held = True

    def move(self, view: str, u: float, v: float, along_axis: bool, turn: bool) -> None:
        """Move the target with the mouse, or turn it; see `Drag.shift` and `Drag.turn`.

        What the mouse did before a key was pressed or let go stays done.

        Raises:
            InputError: if there is no such camera.
        """
        if self._drag is None:
            return
        x, y = self._normalized(view, u, v)
        target = self._driver.target
        if self._keys != (along_axis, turn):
            self._drag = replace(
                self._drag, start=self._last, shift_m=target.shift_m, turn_rad=target.turn_rad
            )
        self._keys, self._last = (along_axis, turn), (x, y)
        if turn:
            target.turn_rad = self._drag.turn(x, y, along_axis)
        else:
            target.shift_m = self._drag.shift(x, y, along_axis)

    def release(self) -> str:
        """Leave the target where it is; return what was done with it, in words."""
        if self._taken is None:
            return ""
        drag, target = self._taken, self._driver.target
        self._drag = self._taken = None
        shifted = 1e3 * float(np.linalg.norm(target.shift_m - drag.shift_m))
        between = so3_exp(target.turn_rad) @ so3_exp(drag.turn_rad).T
        turned = float(np.rad2deg(so3_angle(between)))
        done = [f"by {shifted:.0f} mm"] * (shifted > 0.5) + [f"by {turned:.0f}°"] * (turned > 0.5)
        return ", ".join(done)

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
