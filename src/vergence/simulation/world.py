"""The world of a simulation: the model of a cell with servos and physics."""

from typing import Any

import mujoco
import numpy as np

from vergence.arrays import FloatArray
from vergence.cell.cell import Cell
from vergence.robot.chain import joint_columns
from vergence.simulation.cell_model import CellModel

_SERVO_DAMPING = 1.0  # critical


class World(CellModel):
    """A cell in motion: arms with servos and physics, and a target that moves."""

    def __init__(self, cell: Cell) -> None:
        super().__init__(cell)
        self._qvel = {n: self.model.jnt_dofadr[ids] for n, ids in self._joints.items()}
        self._actuators = {name: self._actuator_ids(name) for name in cell.arms}
        for name in cell.arms:
            self.data.ctrl[self._actuators[name]] = self.joint_position(name)
        mujoco.mj_forward(self.model, self.data)
        self._lag = {name: self._tune_servos(name) for name in cell.arms}

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return float(self.data.time)

    def joint_velocity(self, arm: str) -> FloatArray:
        """Return an arm's joint velocities (n,), rad/s or m/s."""
        velocity: FloatArray = self.data.qvel[self._qvel[arm]]
        return velocity

    def command(self, arm: str, position: FloatArray, velocity: FloatArray) -> None:
        """Set an arm's servos; the rate is fed forward to compensate their lag k_v/k_p."""
        self.data.ctrl[self._actuators[arm]] = position + self._lag[arm] * velocity

    def step(self) -> None:
        """Advance physics by one inner period."""
        mujoco.mj_step(self.model, self.data)

    def _actuator_ids(self, arm: str) -> Any:
        return np.array([self.model.actuator(f"{arm}/{j}").id for j in self.arms[arm].names])

    def _felt_inertia(self, arm: str, inertia: FloatArray) -> FloatArray:
        """Return the inertia (n,) that each joint moves, given that of all joints (N, N)."""
        dofs = [self.model.joint(f"{arm}/{name}").dofadr[0] for name in self.arms[arm].axis_names]
        ratios = joint_columns(self.arms[arm].chain, np.eye(len(dofs)), self.arms[arm].joint_count)
        felt: FloatArray = np.diag(ratios.T @ inertia[np.ix_(dofs, dofs)] @ ratios)
        return felt

    def _tune_servos(self, arm: str) -> FloatArray:
        """Tune every joint to a critically damped servo; return k_v/k_p (n,)."""
        inertia = np.empty((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, inertia)
        bandwidth = 2 * np.pi * self.cell.arms[arm].servo_bandwidth_hz
        felt = self._felt_inertia(arm, inertia)
        kp, kv = felt * bandwidth**2, 2 * _SERVO_DAMPING * bandwidth * felt
        ids = self._actuators[arm]
        self.model.actuator_gainprm[ids, 0] = kp
        self.model.actuator_biasprm[ids, 1] = -kp
        self.model.actuator_biasprm[ids, 2] = -kv
        ratio: FloatArray = kv / kp
        return ratio
