"""Obstacles in a cell, as a constrained law keeps it out of its camera's lines of sight."""

from collections.abc import Callable, Mapping
from copy import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.limits import AXES, COLUMNS, HALF, MIDDLE, RADIUS

if TYPE_CHECKING:
    from vergence.simulation.cell_model import CellModel


class Solids:
    """Fixtures and other arms as rounded boxes, where they are now.

    Targets are left out, since where they are is estimated, and so is the arm that carries the
    camera. Floors hide nothing above them. A mesh is taken for the box
    around it, a cylinder for one with rounded ends.

    Args:
        model: of the cell; its state is copied.
        arm: that carries the camera.
        joints: gives where the arms are now, arm name to positions (n,); where the model has them
            if None.
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
        self._offset = np.zeros((len(self._geoms), 3))  # of the box from the geom's own frame
        for row, geom in enumerate(self._geoms):
            half, radius, self._offset[row] = _rounded_box(model.model, geom)
            self._solids[row, HALF : HALF + 3], self._solids[row, RADIUS] = half, radius

    def __call__(self) -> FloatArray:
        """Return the solids now, (K, 16); see `vergence.control.limits`."""
        if self._joints is not None:
            self._place(self._joints())
        axes = self._data.geom_xmat[self._geoms]
        self._solids[:, AXES : AXES + 9] = axes
        turned = (axes.reshape(-1, 3, 3) @ self._offset[:, :, None])[:, :, 0]
        self._solids[:, MIDDLE : MIDDLE + 3] = self._data.geom_xpos[self._geoms] + turned
        return self._solids

    def _place(self, joints: Mapping[str, FloatArray]) -> None:
        """Put the arms where they are, unless they are there."""
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
    """Return half the sides of a geom's core, the radius around it, and its middle."""
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
