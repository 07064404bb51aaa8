"""No path and no law turns a face away from the camera that start and goal see, if it is known."""

import numpy as np
import pytest
from box_scenes import CAMERA, FACES, MARKS, drawn, least_sine, problem
from gantry_cell import gantry

from vergence.control import DepthFromFeatures, ImageBased, MotionSettings, Servo, Situation
from vergence.estimation import TargetShape
from vergence.estimation.feature_faces import FeatureFaces
from vergence.geometry import se3_inverse, transform_points
from vergence.planning import OptimisedPlanner, Path
from vergence.robot import Arm
from vergence.signals import ImagePoints, JointState, Observation, Reference
from vergence.studies.defaults.study import camera_arm
from vergence.studies.reach_scene import Scene

RATE_HZ = 30.0


@pytest.fixture(scope="module")
def ur5() -> Arm:
    return camera_arm("ur5")


@pytest.mark.parametrize("seed", [12, 82, 126, 135])
def test_a_path_keeps_to_the_front_of_known_faces(ur5: Arm, seed: int) -> None:
    scene = drawn(ur5, seed)
    blind, path = (OptimisedPlanner().plan(problem(scene, known)) for known in (False, True))
    assert isinstance(blind, Path)
    assert min(least_sine(scene, q) for q in blind.q) < 0.0  # so there is something to foresee
    assert isinstance(path, Path)
    assert path.in_front().all()
    assert min(least_sine(scene, q) for q in path.q) > 0.0
    assert path.in_view().all()


@pytest.mark.parametrize("seed", [5, 23, 84, 116])
def test_a_law_keeps_to_the_front_of_known_faces(seed: int) -> None:
    scene = drawn(gantry(), seed)
    assert servoed(scene, known=False) < 0.0
    assert servoed(scene, known=True) > 0.0


def test_only_a_face_that_a_point_cannot_do_without_counts_in_a_proof(ur5: Arm) -> None:
    scene = drawn(ur5, 0)
    asked = problem(scene, True)
    assert np.array_equal(asked.faces, asked.faces_needed)
    R, p = scene.T_world_target[:3, :3], scene.T_world_target[:3, 3]
    corners = FeatureFaces.of_shape(TargetShape.box(np.array([0.16, 0.12, 0.10])))
    planes = np.column_stack((corners.planes[:, :3] @ R.T + p, corners.planes[:, 3:] @ R.T))
    asked = type(asked)(
        asked.arm, asked.camera, asked.q_start, asked.T_world_goal, asked.points_world,
        surface=corners._replace(planes=planes),
    )  # fmt: skip
    assert len(asked.faces) >= 1
    assert not len(asked.faces_needed)


def servoed(scene: Scene, known: bool, longest_s: float = 3.0) -> float:
    """Return the least sine at which a face is seen on the law's way, up to the first below 0."""
    goal = transform_points(se3_inverse(scene.T_world_goal.copy()), scene.points_world)
    depth = goal[:, 2].copy()
    law = Servo(
        scene.arm,
        CAMERA,
        ImageBased(gain=1.0),
        depth_m=depth,
        situation=Situation(
            1.0 / RATE_HZ,
            MotionSettings(feed_forward=False, depth=DepthFromFeatures()),
            features={"": MARKS},
            faces={"": FACES} if known else {},
        ),
    )
    desired = Reference(0.0, scene.goal_px, desired_depth_m=depth)
    q, rates, least = scene.q_start.copy(), np.zeros(len(scene.q_start)), np.inf
    count = len(MARKS)
    covariance = np.tile(1e-6 * np.eye(2), (count, 1, 1))
    for k in range(int(RATE_HZ * longest_s)):
        px = scene.seen_px(scene.arm.forward_kinematics(q))
        view = ImagePoints("", k / RATE_HZ, px, covariance, np.ones(count, bool), ("",) * count)
        joints = JointState(view.time, q, rates)
        rates = law.command(Observation(view.time, (view,)), desired, joints).velocity
        q = q + rates / RATE_HZ
        least = min(least, least_sine(scene, q))
        if least < 0.0:
            break
    return least
