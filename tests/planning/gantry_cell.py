"""The gantry, its camera and the nine marks, as the planners see them."""

from functools import cache
from pathlib import Path

import mujoco
import numpy as np

import vergence
from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.geometry import se3, se3_inverse, so3_exp, transform_points
from vergence.planning.problem import PlanningProblem
from vergence.robot import Arm

CELL = Path(vergence.__file__).parent / "cells" / "gantry"
CAMERA = Camera(640, 480, 720.0, 720.0, 319.5, 239.5)


@cache
def gantry() -> Arm:
    """Return the gantry up to a camera that looks along the flange's x axis, 0.2 m ahead."""
    spec = mujoco.MjSpec.from_file(str(CELL / "gantry.xml"))
    # x of the image along the flange's z. MuJoCo's camera looks along its -z with y up.
    spec.body("flange").add_camera(name="eye", pos=[0.2, 0, 0], xyaxes=[0, 0, 1, 0, 1, 0])
    rates = np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])
    return Arm.from_mujoco(spec.compile(), "eye", rates, 4 * rates)


@cache
def marks() -> FloatArray:
    """Return the marks' centres in the target's frame, (9, 3), m."""
    model = mujoco.MjSpec.from_file(str(CELL / "marks.xml")).compile()
    return frozen([model.site(f"mark{j + 1}").pos for j in range(9)])


# Section 6 of [Mezouar2001]: the displacement is the paper's (its signs are ours); start, target
# and camera are chosen so that every statement of the section holds on exact projections.
DISPLACEMENT = se3(
    so3_exp(np.radians([37.0, 45.0, 125.0])), -np.array([0.82, 0.80, 0.45])
)  # start in the goal camera's frame
Q_START = np.array([0.595, -0.489, -0.221, 2.321, 0.033, 0.781])
T_GOAL_TARGET = se3(so3_exp(np.array([2.4, -1.84, 0.01])), np.array([0.047, 0.0, 0.625]))


def section6(**margins: float) -> PlanningProblem:
    """Return the paper's experiment as a planning problem."""
    arm = gantry()
    T_world_goal = arm.forward_kinematics(Q_START) @ se3_inverse(DISPLACEMENT)
    points = transform_points(T_world_goal @ T_GOAL_TARGET, marks())
    return PlanningProblem(arm, CAMERA, Q_START, T_world_goal, points, **margins)
