"""Where a target appears in an image, so that the mouse can take it."""

from typing import Any

import numpy as np

from vergence.app.watch.viewer_camera import ViewerCamera
from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.geometry import se3_inverse, transform_points
from vergence.simulation.world import World

_NEAR_M = 1e-3
_BOX = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T.astype(np.float64)


def target_corners(world: World, name: str | None = None) -> FloatArray:
    """Return the corners of the boxes around a target's parts, (K, 3), m, in its frame.

    Args:
        world: that it is in.
        name: of the target; the task's if None.
    """
    name = name or world.target_name
    model: Any = world.model
    data: Any = world.data
    T_target_world = se3_inverse(world.target_pose(name))
    corners = [np.zeros((1, 3))]
    for geom in range(model.ngeom):
        if world.target_of(int(model.geom_bodyid[geom])) == name:
            middle, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
            places = (middle + _BOX * half) @ data.geom_xmat[geom].reshape(3, 3).T
            corners.append(transform_points(T_target_world, places + data.geom_xpos[geom]))
    return np.concatenate(corners)


def outline(corners: FloatArray, T_camera_target: FloatArray, camera: Camera) -> FloatArray | None:
    """Return the hull (K, 2) of a target's corners in an image, px.

    None where a part of it is beside or behind the camera.
    """
    seen = transform_points(T_camera_target, corners)
    return _hull(camera.project(seen)) if (seen[:, 2] > _NEAR_M).all() else None


def outline_from(
    viewer_camera: ViewerCamera, corners: FloatArray, T_world_target: FloatArray
) -> list[list[float]] | None:
    """Return the hull of a target's corners as the viewer's camera sees it, normalized.

    None where a part of it is beside or behind it.
    """
    seen = transform_points(se3_inverse(viewer_camera.T_world_camera) @ T_world_target, corners)
    if (seen[:, 2] < _NEAR_M).any():
        return None
    hull: list[list[float]] = _hull(seen[:, :2] / seen[:, 2:]).round(5).tolist()
    return hull


def _hull(places: FloatArray) -> FloatArray:
    import cv2

    return np.asarray(cv2.convexHull(places.astype(np.float32))[:, 0], dtype=np.float64)
