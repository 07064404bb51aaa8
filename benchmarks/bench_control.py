"""One control tick: four points, six joints, against ViSP in C++ and machinevision-toolbox."""

from collections.abc import Callable
from importlib.resources import files
from typing import Any

import numpy as np
from numba import njit

from harness import calls, loops, row
from peer_programs import machinevision, visp
from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.control import OptimalTrackingLaw, optimal_tracking_tick, tracking_displacement
from vergence.features import interaction_matrix_points
from vergence.robot import Arm

POSE = np.array([-2.19, 0.75, -3.01, 0.1, -0.87, 0.2])
WANTED = 0.1 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
SEEN = WANTED + np.array([0.05, -0.03])
DEPTH = np.array([0.60, 0.62, 0.63, 0.61])


def puma() -> Arm:
    import mujoco

    model = str(files("vergence").joinpath("cells/puma560/puma560.xml"))
    return Arm.from_mujoco(mujoco.MjModel.from_xml_path(model), "flange", kind="body")


def law_of(arm: Arm) -> OptimalTrackingLaw:
    camera = Camera(640, 480, 1454.0, 1230.0, 319.5, 239.5)
    return OptimalTrackingLaw(arm, camera, DEPTH, avoidance_axes=("x", "y", "z"), S=1e-6)


def law_alone(law: OptimalTrackingLaw) -> Callable[[], FloatArray]:
    """Interaction matrix and displacement, without the arm: what `vpServo` does for a camera."""
    none = np.zeros(6)
    gains = law.gains._replace(S=0.0)

    def tick() -> FloatArray:
        error = (SEEN - WANTED).ravel()
        return tracking_displacement(
            error, interaction_matrix_points(SEEN, DEPTH), gains, 1.0, none
        )

    return tick


def whole_tick(law: OptimalTrackingLaw) -> tuple[Any, ...]:
    """The arguments of a tick with kinematics and the exact gradient of w'."""
    limits = np.vstack((law.arm.q_min, law.arm.q_max, law.arm.rate_max))
    focal = law.camera.focal_px
    penalty = (law.penalty_k, law.per_joint, law.singular_below)
    return (law.arm.chain, limits, POSE, SEEN, WANTED, DEPTH, focal, law.gains, *penalty)


@njit
def repeat_tick(  # type: ignore[no-untyped-def]
    count, chain, limits, q, points, desired, depth, focal, gains, k, per_joint, damping
):
    """Ticks inside a kernel; each at a new configuration, so that none can be left out."""
    total, q = 0.0, q.copy()
    for _ in range(count):
        q[0] += 1e-9
        tick = optimal_tracking_tick(
            chain, limits, q, points, desired, depth, focal, gains, k, per_joint, damping
        )
        total += tick[0][0]
    return total


def run() -> list[dict[str, Any]]:
    law = law_of(puma())
    alone = calls(law_alone(law))
    arguments = whole_tick(law)
    tick = calls(lambda: optimal_tracking_tick(*arguments))
    inside = loops(lambda count: repeat_tick(count, *arguments))
    return [
        row("control: interaction matrix + law", alone, visp("tick"), ratio_aim=0.15),
        row("control: interaction matrix + law", alone, machinevision("tick")),
        row("control: with kinematics", tick, visp("tick_kinematics"), ratio_aim=0.3),
        row("control: with exact w' gradient", tick, visp("tick_joint_limits"), value_aim=4.0),
        row("control: the same, inside a kernel", inside, value_aim=2.5),
    ]
