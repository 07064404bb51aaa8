"""What in a cell is between a camera and the target, for the joints the arms report."""

from collections.abc import Mapping
from copy import copy
from typing import TYPE_CHECKING

import numpy as np

from vergence.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    from vergence.simulation.cell_model import CellModel

_TARGET_GROUP = 5  # MuJoCo's last group of geometry


class Obstacles:
    """Arms and fixtures of a cell as they are known from its file and from joint positions.

    It asks rays whether anything is in the way. The target is left out: where it is has to be
    estimated, and how it hides itself follows from that estimate.

    Args:
        model: of the cell; its geometry is copied, its state is not looked at.
    """

    def __init__(self, model: "CellModel") -> None:
        import mujoco

        self._cell_model = model
        self._model = copy(model.model)
        of_target = [model.belongs_to_target(int(body)) for body in self._model.geom_bodyid]
        group = np.minimum(self._model.geom_group, _TARGET_GROUP - 1)
        self._model.geom_group[:] = np.where(of_target, _TARGET_GROUP, group)
        self._groups = np.array([1] * _TARGET_GROUP + [0], dtype=np.uint8)
        self._data = mujoco.MjData(self._model)

    def move(self, joints: Mapping[str, FloatArray]) -> None:
        """Put the arms where their joints say, arm name to positions (n,)."""
        import mujoco

        for arm, position in joints.items():
            self._cell_model.write_position(self._data, arm, position)
        mujoco.mj_kinematics(self._model, self._data)

    def blocked(self, eye: FloatArray, points: FloatArray) -> BoolArray:
        """Return which points (N, 3) are hidden from an eye (3,), (N,); world frame, m."""
        from vergence.simulation.cell_model import hidden

        eye = np.ascontiguousarray(eye, dtype=np.float64)
        return hidden(self._model, self._data, eye, points, self._groups)
