"""Obstacles in a cell, for laws that keep them out of the camera's lines of sight."""

from collections.abc import Callable, Mapping
from copy import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.limits import AXES, COLUMNS, HALF, MIDDLE, RADIUS

if TYPE_CHECKING:
    from vergence.simulation.cell_model import CellModel


class Solids:
    """Fixtures and other arms as rounded boxes at their present poses.

    Targets are excluded because their poses are estimated, and so is the arm that carries the
    camera. Floors occlude nothing above them. A mesh is replaced by its bounding box, a cylinder by
    one with rounded ends.

    Args:
        model: of the cell; its state is copied.
        arm: that carries the camera.
        joints: returns the present joint positions, arm name to (n,); those of the model if None.
    """

    def __init__(
        self,
        model: "CellModel",
        arm: str,
        joints: Callable[[], Mapping[str, FloatArray]] | None = None,
    ) -> None:
        self._model, self._data = model, copy(model.data)
        self._joints = joints
        self._placed: Mapping[str, FloatArray] | None = None
        own = model.bodies_of(arm)
        self._geoms = np.array(
            [
                geom
                for geom, body in enumerate(model.model.geom_bodyid)
                if model.target_of(int(body)) is None
                and int(body) not in own
                and _hides(model.model, geom)
            ],
            dtype=np.int64,
        )
        self._solids = np.zeros((len(self._geoms), COLUMNS))
        self._offset = np.zeros((len(self._geoms), 3))  # of the box in the geom's own frame
        for row, geom in enumerate(self._geoms):
            half, radius, self._offset[row] = _rounded_box(model.model, geom)
            self._solids[row, HALF : HALF + 3], self._solids[row, RADIUS] = half, radius

    def __call__(self) -> FloatArray:
        """Return the present solids, (K, 16); see `vergence.control.limits`."""
        if self._joints is not None:
            self._place(self._joints())
        axes = self._data.geom_xmat[self._geoms]
        self._solids[:, AXES : AXES + 9] = axes
        turned = (axes.reshape(-1, 3, 3) @ self._offset[:, :, None])[:, :, 0]
        self._solids[:, MIDDLE : MIDDLE + 3] = self._data.geom_xpos[self._geoms] + turned
        return self._solids

    def _place(self, joints: Mapping[str, FloatArray]) -> None:
        """Set the joint positions of the arms if they have changed."""
        if joints is self._placed:
            return
        import mujoco

        for arm, position in joints.items():
            self._model.write_position(self._data, arm, position)
        mujoco.mj_kinematics(self._model.model, self._data)
        self._placed = joints


def _hides(model: Any, geom: int) -> bool:
    import mujoco

    flat = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
    kind = mujoco.mjtGeom(int(model.geom_type[geom]))
    return kind not in flat and bool(model.geom_rgba[geom, 3] > 0)


def _rounded_box(model: Any, geom: int) -> tuple[FloatArray, float, FloatArray]:
    """Return the half sides of a geom's core box, the radius around it, and its centre."""
    from mujoco import mjtGeom

    size, middle = model.geom_size[geom], np.zeros(3)
    match mjtGeom(int(model.geom_type[geom])):
        case mjtGeom.mjGEOM_SPHERE:
            return np.zeros(3), float(size[0]), middle
        case mjtGeom.mjGEOM_CAPSULE | mjtGeom.mjGEOM_CYLINDER:
            return np.array([0.0, 0.0, size[1]]), float(size[0]), middle
        case mjtGeom.mjGEOM_BOX:
            return size.copy(), 0.0, middle
        case _:
            around = model.geom_aabb[geom]
            return around[3:].copy(), 0.0, around[:3].copy()
