"""The moments that each image row is exposed at, and the state of the world at them."""

from collections import deque
from typing import Any, NamedTuple

import mujoco
import numpy as np

from vergence.arrays import FloatArray
from vergence.cell.schema import ImagingTable
from vergence.geometry import se3_inverse, transform_points
from vergence.simulation.build import FROM_MUJOCO_CAMERA
from vergence.simulation.cell_model import CellModel

_STEP_PX = 0.5  # image motion between two moments; widens the blur by 0.2 px at most
_MOST_MOMENTS = 32  # in one image
_NEAREST_M = 0.05  # distance at which motion is evaluated at the least


class _State(NamedTuple):
    """The state of the world at one tick."""

    qpos: FloatArray
    mocap_pos: FloatArray
    mocap_quat: FloatArray


class Shutter:
    """Remembers the last states of a world, and interpolates between them.

    Args:
        world: the world.
        longest_s: the longest time for which a camera's shutter is open.
        rate_hz: of the ticks.
    """

    def __init__(self, world: CellModel, longest_s: float, rate_hz: float) -> None:
        self._world, self._rate = world, rate_hz
        self._past = mujoco.MjData(world.model)
        count = int(np.ceil(longest_s * rate_hz)) + 3
        self._states: deque[_State] = deque(maxlen=count)
        self._last = 0  # tick of the latest state

    def begin(self, tick: int) -> None:
        """Forget all states: the world has been at rest in its present state."""
        self._states.clear()
        self.remember(tick)

    def remember(self, tick: int) -> None:
        """Remember the world's state at a tick, one after the last."""
        data = self._world.data
        quat = data.mocap_quat.copy()
        if self._states:  # q and -q are the same rotation; blended ones must have the same sign
            before = self._states[-1].mocap_quat
            quat *= np.where(np.sum(quat * before, axis=1) < 0.0, -1.0, 1.0)[:, None]
        self._states.append(_State(data.qpos.copy(), data.mocap_pos.copy(), quat))
        self._last = tick

    def ticks_after(self, imaging: ImagingTable) -> int:
        """Return the number of ticks from the middle of an exposure until its image is complete."""
        return int(np.ceil(imaging.open_s / 2 * self._rate))

    def moments(self, camera: str, tick: int, imaging: ImagingTable) -> FloatArray:
        """Return the ticks to render for an image exposed around a tick, (J,), evenly spaced.

        There are enough that the image moves by half a pixel between two of them, at the targets'
        distances; one if nothing moves.
        """
        half = imaging.open_s / 2 * self._rate
        ticks = tick + half * np.linspace(-1.0, 1.0, 5)
        bodies = self._world.target_bodies.values()
        moved = max(self._displacement(camera, ticks, body) for body in bodies)
        if moved < 0.05:
            return np.array([float(tick)])
        count = int(np.clip(np.ceil(moved / _STEP_PX) + 1, 3, _MOST_MOMENTS))
        return tick + half * np.linspace(-1.0, 1.0, count)

    def at(self, tick: float) -> Any:
        """Return MuJoCo's state at a tick, possibly fractional; valid until the next call."""
        back = float(np.clip(self._last - tick, 0, len(self._states) - 1))
        newer = len(self._states) - 1 - int(back)
        older, share = max(newer - 1, 0), back - int(back)
        a, b = self._states[newer], self._states[older]
        self._past.qpos[:] = (1.0 - share) * a.qpos + share * b.qpos
        self._past.mocap_pos[:] = (1.0 - share) * a.mocap_pos + share * b.mocap_pos
        self._past.mocap_quat[:] = (1.0 - share) * a.mocap_quat + share * b.mocap_quat
        mujoco.mj_kinematics(self._world.model, self._past)
        mujoco.mj_camlight(self._world.model, self._past)
        return self._past

    def _displacement(self, camera: str, ticks: FloatArray, target: int) -> float:
        """Return the largest image motion over some ticks, px.

        Considers stationary points and points that move with a target, at the target's distance.
        """
        poses = [self._poses(camera, tick, target) for tick in ticks]
        T_camera, T_target = poses[len(poses) // 2]
        depth = (se3_inverse(T_camera) @ T_target)[2, 3]
        lens = self._world.cameras[camera]
        u, v = np.meshgrid(np.linspace(0, lens.width - 1, 5), np.linspace(0, lens.height - 1, 5))
        grid = np.column_stack((u.ravel(), v.ravel()))
        rays = np.column_stack((lens.normalize(grid), np.ones(len(grid))))
        points = transform_points(T_camera, rays * max(depth, _NEAREST_M))
        moved = 0.0
        for carried in (False, True):
            places = []
            for T_world_camera, T_world_target in poses:
                motion = T_world_target @ se3_inverse(T_target) if carried else np.eye(4)
                seen = transform_points(se3_inverse(T_world_camera) @ motion, points)
                seen[:, 2] = np.maximum(seen[:, 2], _NEAREST_M)
                places.append(lens.project(seen))
            steps = np.linalg.norm(np.diff(places, axis=0), axis=2)
            moved = max(moved, float(steps.sum(axis=0).max()))
        return moved

    def _poses(self, camera: str, tick: float, body: int) -> tuple[FloatArray, FloatArray]:
        """Return T_world_camera and T_world_target, (4, 4) each, of a target's body at a tick."""
        data, model = self.at(tick), self._world.model
        T_camera, T_target = np.eye(4), np.eye(4)
        number = model.camera(camera).id
        T_camera[:3, :3] = data.cam_xmat[number].reshape(3, 3) @ FROM_MUJOCO_CAMERA
        T_camera[:3, 3] = data.cam_xpos[number]
        T_target[:3, :3], T_target[:3, 3] = data.xmat[body].reshape(3, 3), data.xpos[body]
        return T_camera, T_target
