"""Plug in a law: anything with a `command` method servoes."""

from dataclasses import dataclass

import numpy as np

from vergence.camera import Camera
from vergence.cell import load_cell
from vergence.features import interaction_matrix_points
from vergence.planning import FixedReference
from vergence.robot import Arm
from vergence.runtime import Loop
from vergence.signals import JointCommand, JointState, Observation, Reference
from vergence.simulation import ExactPoints, SimulatedDriver

SQUARE = "[[0.06, 0.06, 0.0], [-0.06, 0.06, 0.0], [-0.06, -0.06, 0.0], [0.06, -0.06, 0.0]]"


@dataclass(frozen=True)
class TransposeLaw:
    """v = -λ Lᵀ e: no inverse anywhere, slow but hard to upset."""

    arm: Arm
    camera: Camera
    depth_m: float
    gain: float

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        seen = self.camera.normalize(observation.views[-1].points_px)
        error = (seen - self.camera.normalize(reference.points_px)).ravel()
        L = interaction_matrix_points(seen, np.full(len(seen), self.depth_m))
        v_camera = -self.gain * L.T @ error
        return JointCommand(np.linalg.pinv(self.arm.jacobian(joints.position)) @ v_camera, v_camera)


def main() -> None:
    settings = {"target.features": SQUARE, "target.motion": '{ kind = "stationary" }'}
    driver = SimulatedDriver(load_cell("puma560", settings), images=False)
    truth = driver.first_frame("wrist").truth
    assert truth is not None
    law = TransposeLaw(driver.world.arm_to_camera("wrist"), driver.cameras["wrist"], 1.0, 0.4)
    goal = FixedReference(Reference(0.0, truth.points_px + (60.0, 40.0)))
    loop = Loop(driver, "puma", ExactPoints("wrist"), goal, law, outer_rate_hz=30)
    print(loop.run(duration_s=8.0))
    left = driver.first_frame("wrist").truth.points_px - truth.points_px - (60.0, 40.0)
    print(f"largest error at the end: {np.abs(left).max():.2f} px")


if __name__ == "__main__":
    main()
