"""Planning and two-view geometry: the gantry's large displacement, nine marks on three planes."""

from collections.abc import Callable
from importlib.resources import files
from itertools import cycle
from typing import Any

import numpy as np

from harness import Peer, calls, row
from peer_programs import visp
from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.geometry import se3, se3_inverse, so3_exp, transform_points
from vergence.planning.field import Field, FieldPath, descend
from vergence.planning.optimised import OptimisedPlanner
from vergence.planning.potential_field import PotentialFieldPlanner, make_field
from vergence.planning.problem import PlanningProblem
from vergence.robot import Arm
from vergence.vision.two_view import estimate_two_view
from vergence.vision.two_view.decomposition import decompose_homography
from vergence.vision.two_view.linear import linear_homography

CAMERA = Camera(640, 480, 720.0, 720.0, 319.5, 239.5)
Q_START = np.array([0.595, -0.489, -0.221, 2.321, 0.033, 0.781])
T_GOAL_TARGET = se3(so3_exp(np.array([2.4, -1.84, 0.01])), np.array([0.047, 0.0, 0.625]))


def scene() -> tuple[Arm, FloatArray]:
    """Return the gantry up to its camera and the marks in the target's frame."""
    import mujoco

    cell = files("vergence").joinpath("cells/gantry")
    spec = mujoco.MjSpec.from_file(str(cell.joinpath("gantry.xml")))
    spec.body("flange").add_camera(name="eye", pos=[0.2, 0, 0], xyaxes=[0, 0, 1, 0, 1, 0])
    rates = np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])
    marks = mujoco.MjModel.from_xml_path(str(cell.joinpath("marks.xml")))
    points = np.array([marks.site(f"mark{j + 1}").pos for j in range(9)])
    return Arm.from_mujoco(spec.compile(), "eye", rates, 4 * rates), points


def problem_of(arm: Arm, marks: FloatArray, T_goal_start: FloatArray) -> PlanningProblem:
    T_world_goal = arm.forward_kinematics(Q_START) @ se3_inverse(T_goal_start)
    points = transform_points(T_world_goal @ T_GOAL_TARGET, marks)
    return PlanningProblem(arm, CAMERA, Q_START, T_world_goal, points)


def solvable(arm: Arm, marks: FloatArray, count: int) -> list[PlanningProblem]:
    """Return displacements about the paper's with random parts of it, of those that have a path."""
    random, planner = np.random.default_rng(0), OptimisedPlanner(tree_samples=0)
    turn, way = np.radians([37.0, 45.0, 125.0]), -np.array([0.82, 0.80, 0.45])
    problems: list[PlanningProblem] = []
    while len(problems) < count:
        part = random.uniform(0.4, 1.1, (2, 3))
        problem = problem_of(arm, marks, se3(so3_exp(part[0] * turn), part[1] * way))
        if planner.plan(problem):
            problems.append(problem)
    return problems


def numpy_descend(field: Field, arm: Arm, upsilon: FloatArray, q: FloatArray) -> int:
    """Walk the same steps in plain NumPy and SciPy; return how many they were."""
    from scipy.spatial.transform import Rotation

    def kinematics(q: FloatArray) -> tuple[FloatArray, FloatArray]:
        T, axes, anchors = np.eye(4), [], []
        for i in range(len(q) + 1):
            fixed = np.eye(4)
            fixed[:3, :3], fixed[:3, 3] = arm.chain.rotation[i], arm.chain.position[i]
            T = T @ fixed
            if i == len(q):
                break
            axes.append(T[:3, 2].copy())
            anchors.append(T[:3, 3].copy())
            joint = np.eye(4)
            if arm.chain.sliding[i]:
                joint[2, 3] = q[i]
            else:
                joint[:3, :3] = Rotation.from_rotvec([0, 0, q[i]]).as_matrix()
            T = T @ joint
        J = np.zeros((6, len(q)))
        for i, (z, o) in enumerate(zip(axes, anchors, strict=True)):
            slide = arm.chain.sliding[i]
            J[:3, i] = z if slide else np.cross(z, T[:3, 3] - o)
            J[3:, i] = 0 if slide else z
        Rt = T[:3, :3].T
        return T, np.vstack((Rt @ J[:3], Rt @ J[3:]))

    def skew(w: FloatArray) -> FloatArray:
        return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])

    def parameter(upsilon: FloatArray) -> FloatArray:
        M, w = np.zeros((6, 6)), upsilon[3:]
        angle = max(float(np.linalg.norm(w)), 1e-9)
        W = skew(w / angle)
        M[:3, :3] = field.distance * Rotation.from_rotvec(w).as_matrix().T
        M[3:, 3:] = np.eye(3) - (1 - np.cos(angle)) / angle * W
        M[3:, 3:] += (1 - np.sin(angle) / angle) * W @ W
        return M

    rays = np.column_stack((field.m_star, np.ones(len(field.m_star))))
    inverse = rays @ field.normal - field.delta
    signs = np.array([1.0, -1.0, 1.0, -1.0])
    step, before, epsilon, taken = 0.02, np.zeros(6), 0.02, 0
    half, middle = (field.q_max - field.q_min) / 2, (field.q_max + field.q_min) / 2
    while np.linalg.norm(upsilon) > 1e-9 and taken < 1500:
        T, J = kinematics(q)
        R = Rotation.from_rotvec(upsilon[3:]).as_matrix()
        points = (rays - np.outer(inverse, upsilon[:3])) @ R
        m = points[:, :2] / points[:, 2:]
        depth = field.distance * points[:, 2] / inverse
        M = parameter(upsilon)
        w = np.clip(signs * (m[:, [0, 0, 1, 1]] - field.bounds) / field.image_zone, 0.02, None)
        pull = np.where(w < 1, -signs * (1 / w - 1) / (w**2 * field.image_zone), 0.0)
        slope = np.column_stack((pull[:, :2].sum(axis=1), pull[:, 2:].sum(axis=1))).ravel()
        x, y, Z = m[:, 0], m[:, 1], depth
        zero = np.zeros(len(m))
        L = np.empty((2 * len(m), 6))
        L[0::2] = np.column_stack((-1 / Z, zero, x / Z, x * y, -(1 + x**2), y))
        L[1::2] = np.column_stack((zero, -1 / Z, y / Z, 1 + y**2, -x * y, -x))
        place = (q - middle) / half
        border = 1 - field.joint_zone
        size = np.minimum(np.abs(place), 1 - 0.01 * field.joint_zone)
        excess = np.where(size > border, 1 / (1 - size**2) - 1 / (1 - border**2), 0.0)
        push = np.sign(place) * excess * 2 * size / (1 - size**2) ** 2 / half
        force = -upsilon - field.gain_image * M.T @ (L.T @ slope)
        force -= field.gain_joint * M.T @ np.linalg.solve(J @ J.T + 1e-8 * np.eye(6), J @ push)
        direction, distance = force / np.linalg.norm(force), float(np.linalg.norm(upsilon))
        epsilon = 0.5 * epsilon if direction @ before < 0 else min(1.2 * epsilon, step)
        before = direction
        after = upsilon + min(epsilon, distance) * direction
        if distance <= epsilon and direction @ upsilon < -0.5 * distance:
            after = np.zeros(6)
        q = q + np.linalg.pinv(J) @ (M @ (after - upsilon))
        T, J = kinematics(q)
        R = Rotation.from_rotvec(after[3:]).as_matrix()
        desired = field.T_world_star[:3, :3] @ R
        place_desired = field.T_world_star[:3, :3] @ (field.distance * after[:3])
        place_desired += field.T_world_star[:3, 3]
        turn = Rotation.from_matrix(T[:3, :3].T @ desired).as_rotvec()
        missing = np.concatenate((T[:3, :3].T @ (place_desired - T[:3, 3]), turn))
        q = q + np.linalg.pinv(J) @ missing
        upsilon, taken = after, taken + 1
    return taken


def scipy_two_view(m_star: FloatArray, m: FloatArray) -> Callable[[], object]:
    """Return bundle adjustment of the same residuals by SciPy, from the linear solution."""
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    from vergence.vision.two_view.decomposition import inverse_depths
    from vergence.vision.two_view.motions import motion_minima

    def residuals(p: FloatArray) -> FloatArray:
        rays = np.column_stack((p[6:24].reshape(9, 2), np.ones(9)))
        t = p[3:6] / np.linalg.norm(p[3:6])
        X = rays @ Rotation.from_rotvec(p[:3]).as_matrix().T + np.outer(p[24:], t)
        seen = X[:, :2] / X[:, 2:]
        return np.concatenate(((rays[:, :2] - m_star).ravel(), (seen - m).ravel()))

    def solve() -> object:
        found = motion_minima(m_star, m, 4, 1e-5)
        R, t = found.R[0], found.t[0]
        w, _ = inverse_depths(R, t, m_star, m)
        start = np.concatenate((Rotation.from_matrix(R).as_rotvec(), t, m_star.ravel(), w))
        return least_squares(residuals, start, method="lm")

    return solve


def run() -> list[dict[str, Any]]:
    import cv2

    arm, marks = scene()
    paper = problem_of(
        arm, marks, se3(so3_exp(np.radians([37.0, 45.0, 125.0])), -np.array([0.82, 0.80, 0.45]))
    )
    field, upsilon = make_field(PotentialFieldPlanner(), paper)
    q, chain = Q_START.copy(), arm.chain

    def walk() -> FieldPath:
        return descend(field, chain, upsilon, q, 0.02, 1500)

    steps = len(walk().q) - 1
    in_numpy = Peer("plain NumPy", calls(lambda: numpy_descend(field, arm, upsilon, q)))
    planner, turns = OptimisedPlanner(), cycle(solvable(arm, marks, 24))
    random = np.random.default_rng(1)
    desired = CAMERA.project(paper.points_goal) + 0.3 * random.normal(size=(9, 2))
    start = transform_points(se3_inverse(arm.forward_kinematics(q)), paper.points_world)
    current = CAMERA.project(start) + 0.3 * random.normal(size=(9, 2))
    m_star, m = CAMERA.normalize(desired), CAMERA.normalize(current)
    H = np.array([[0.9, -0.3, 0.1], [0.2, 1.0, -0.1], [0.1, 0.05, 1.0]])
    mapped = np.column_stack((m_star, np.ones(9))) @ H.T
    mapped = np.ascontiguousarray(mapped[:, :2] / mapped[:, 2:])

    def by_opencv() -> object:
        found, _ = cv2.findHomography(m_star, mapped, 0)
        return cv2.decomposeHomographyMat(found, np.eye(3))

    return [
        row(
            f"planning: the paper's plan, {steps} steps", calls(walk), in_numpy,
            unit="ms", value_aim=3.0, rounds=7,
        ),
        row(
            "planning: optimised plan", calls(lambda: planner.plan(next(turns))),
            unit="ms", value_aim=60.0, rounds=24, round_seconds=0.001,
        ),
        row(
            "two views: motion and shape, refined",
            calls(lambda: estimate_two_view(current, desired, CAMERA, noise_px=0.3)),
            Peer("SciPy least_squares", calls(scipy_two_view(m_star, m))),
            unit="ms", value_aim=3.0,
        ),
        row(
            "two views: homography + decomposition",
            calls(lambda: decompose_homography(linear_homography(m_star, mapped))),
            Peer("OpenCV", calls(by_opencv)), ratio_aim=1.0,
        ),
        row(
            "two views: the same, 4 points",
            calls(lambda: decompose_homography(linear_homography(m_star[:4], mapped[:4]))),
            visp("homography_dlt"), ratio_aim=1.0,
        ),
        row(
            "two views: the same, 8 points",
            calls(lambda: decompose_homography(linear_homography(m_star[:8], mapped[:8]))),
            visp("homography_hlm"), ratio_aim=1.0,
        ),
    ]  # fmt: skip
