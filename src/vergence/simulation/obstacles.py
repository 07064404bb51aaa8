"""Occlusions between a camera and a target, for the joint positions that the arms report."""

from collections.abc import Mapping
from copy import copy
from typing import TYPE_CHECKING

import numpy as np

from vergence.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    from vergence.simulation.cell_model import CellModel

_LEFT_OUT = 5  # the last group of geoms in MuJoCo


class Obstacles:
    """Arms and fixtures of a cell as modelled, and other targets where they are estimated to be.

    Rays decide whether anything is in the way. The target itself is excluded: its pose has to be
    estimated, and its self-occlusion follows from that estimate. So is every other target without
    an estimate.

    Args:
        model: of the cell; its geometry is copied, its state is not used.
        target: name of the target; the task's if None.
    """

    def __init__(self, model: "CellModel", target: str | None = None) -> None:
        import mujoco

        self._cell_model, self._target = model, target or model.target_name
        self._model = copy(model.model)
        self._group = np.minimum(self._model.geom_group, _LEFT_OUT - 1)
        self._owner = np.array(
            [model.target_of(int(body)) or "" for body in self._model.geom_bodyid], dtype=object
        )
        self._groups = np.array([1] * _LEFT_OUT + [0], dtype=np.uint8)
        self._data = mujoco.MjData(self._model)
        self._show(frozenset())

    def move(
        self, joints: Mapping[str, FloatArray], targets: Mapping[str, FloatArray] | None = None
    ) -> None:
        """Set the joint positions of arms and the poses of other targets.

        Args:
            joints: arm name to positions (n,).
            targets: names of other targets to T_world_target (4, 4), as far as they are known.
        """
        import mujoco

        for arm, position in joints.items():
            self._cell_model.write_position(self._data, arm, position)
        mujoco.mj_kinematics(self._model, self._data)
        others = {name: T for name, T in (targets or {}).items() if name != self._target}
        if others.keys() != self._shown:
            self._show(frozenset(others))
        if others:
            for name, T_world_target in others.items():
                self._put(self._cell_model.target_bodies[name], T_world_target)
            mujoco.mj_kinematics(self._model, self._data)

    def blocked(self, eye: FloatArray, points: FloatArray) -> BoolArray:
        """Return which points (N, 3) are occluded for a viewpoint (3,), (N,); world frame, m."""
        from vergence.simulation.cell_model import hidden

        eye = np.ascontiguousarray(eye, dtype=np.float64)
        return hidden(self._model, self._data, eye, points, self._groups)

    def _show(self, others: frozenset[str]) -> None:
        """Let only these targets occlude."""
        self._shown = others
        left_out = np.array([owner != "" and owner not in others for owner in self._owner])
        self._model.geom_group[:] = np.where(left_out, _LEFT_OUT, self._group)

    def _put(self, body: int, T_world_target: FloatArray) -> None:
        """Set the pose of a target, even one that an arm carries."""
        from vergence.geometry import matrix_to_quaternion, se3_inverse
        from vergence.simulation.cell_model import put_target

        if self._model.body_mocapid[body] >= 0:
            put_target(self._model, self._data, body, T_world_target)
            return
        holder = self._model.body_parentid[body]
        T_world_holder = np.eye(4)
        T_world_holder[:3, :3] = self._data.xmat[holder].reshape(3, 3)
        T_world_holder[:3, 3] = self._data.xpos[holder]
        T = se3_inverse(T_world_holder) @ T_world_target
        self._model.body_pos[body] = T[:3, 3]
        self._model.body_quat[body] = matrix_to_quaternion(np.ascontiguousarray(T[:3, :3]))
