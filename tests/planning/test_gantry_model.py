"""The gantry's model file against the closed form of its kinematics."""

import mujoco
import numpy as np
from gantry_cell import CELL, gantry, marks


def test_flange_pose_is_the_published_closed_form() -> None:
    model = mujoco.MjSpec.from_file(str(CELL / "gantry.xml")).compile()
    data = mujoco.MjData(model)
    random = np.random.default_rng(0)
    for _ in range(20):
        q = random.uniform(model.jnt_range[:, 0], model.jnt_range[:, 1])
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        (s4, s5, sa), (c4, c5, ca) = np.sin(q[3:]), np.cos(q[3:])
        R = [
            [s4 * s5 * ca + c4 * sa, -s4 * s5 * sa + c4 * ca, -s4 * c5],
            [-c4 * s5 * ca + s4 * sa, c4 * s5 * sa + s4 * ca, c4 * c5],
            [c5 * ca, -c5 * sa, s5],
        ]
        t = [q[0] - 0.06924 * c4, q[1] - 0.06924 * s4, q[2]]
        np.testing.assert_allclose(data.body("flange").xmat.reshape(3, 3), R, atol=1e-9)
        np.testing.assert_allclose(data.body("flange").xpos, t, atol=1e-9)


def test_limits_are_the_published_ones() -> None:
    np.testing.assert_allclose(
        gantry().q_min, [-0.6501, -0.6001, -0.5001, -2.7301, -0.1001, -1.5901]
    )
    np.testing.assert_allclose(gantry().q_max, [0.7001, 0.5201, 0.4601, 2.7301, 2.4801, 1.5901])


def test_camera_looks_along_the_x_axis_of_the_flange() -> None:
    T = gantry().forward_kinematics(np.array([0.1, 0.2, 0.3, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(T[:3, 2], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(T[:3, 3], [0.1 - 0.06924, 0.2, 0.5], atol=1e-9)


def test_nine_marks_lie_on_three_planes_no_four_of_them_on_one() -> None:
    points = marks()
    for plane in range(3):
        a, b, c = points[3 * plane : 3 * plane + 3]
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        others = np.delete(points, [3 * plane, 3 * plane + 1, 3 * plane + 2], axis=0)
        assert (np.abs((others - a) @ normal) > 0.004).all()
