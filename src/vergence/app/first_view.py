"""From where a cell is first looked at, by whoever watches it or reads its report."""

from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.simulation.cell_model import CellModel

_ASIDE_DEG = 70.0, -70.0, 110.0, -110.0, 30.0, -30.0, 150.0, -150.0  # of the line to the target
_DOWN_DEG = -22.0
_FREE_M = 0.15
_CLEAR = 0.9  # of the way to the middle that nothing fixed may block


def points_in_view(world: CellModel) -> FloatArray:
    """Return the points that a first view of a cell shows, (K, 3): from arm to target."""
    data, cell = world.data, world.cell
    foot = np.array(cell.arms[cell.task.arm].position_m)
    bodies = [data.xpos[body] for arm in cell.arms for body in sorted(world.bodies_of(arm))]
    return np.array([foot, *bodies, world.target_pose()[:3, 3]])


def first_view(world: CellModel, points: FloatArray) -> Any:
    """Return MuJoCo's free camera, aside of the line from the first of points (K, 3) to the last.

    It is on a side from which no wall or other fixed thing hides the middle, if there is one.
    """
    import mujoco

    low, high = points.min(axis=0), points.max(axis=0)
    across = points[-1] - points[0]
    camera = mujoco.MjvCamera()
    camera.lookat[:] = (low + high) / 2
    camera.distance = 1.5 * float(np.linalg.norm(high - low)) + _FREE_M
    camera.elevation = _DOWN_DEG
    ahead = float(np.rad2deg(np.arctan2(across[1], across[0])))
    sides = [ahead + aside for aside in _ASIDE_DEG]
    camera.azimuth = next((side for side in sides if _is_clear(world, camera, side)), sides[0])
    return camera


def _is_clear(world: CellModel, camera: Any, azimuth_deg: float) -> bool:
    """Return whether a free camera sees its middle past all that is fixed in the world."""
    azimuth, elevation = np.deg2rad(azimuth_deg), np.deg2rad(camera.elevation)
    level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    forward = np.cos(elevation) * level + np.array([0.0, 0.0, np.sin(elevation)])
    eye = np.ascontiguousarray(camera.lookat - camera.distance * forward)
    far, body = world.ray(eye, np.ascontiguousarray(forward))
    return body != 0 or far > _CLEAR * camera.distance
