"""The pose filter against filterpy and plain NumPy; selection, visibility, and the whole tick."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from harness import Block, Peer, calls, loops, row
from peer_programs import SOURCES, python_peer
from vergence.arrays import FloatArray, IntArray
from vergence.camera import Camera
from vergence.estimation import (
    CameraRig,
    Candidates,
    InformationSelection,
    PoseFilter,
    PosePerception,
    TargetShape,
    predict_visibility,
)
from vergence.estimation.filters.information import compress, joseph_update
from vergence.estimation.filters.motion import predict_covariance
from vergence.estimation.filters.pose_filter import correct
from vergence.geometry import moved_pose, se3, se3_compose, se3_inverse, transform_points
from vergence.signals import Frame, ImagePoints

PERIOD = 1.0 / 26.0
CAMERA = Camera.from_lens(8.0, (8.3, 8.3), 768, 576)
BOX = TargetShape.box((0.12, 0.12, 0.06))
GATE = 13.8
DENSITY = np.array([0.01, 0.25])


def look_at(eye: FloatArray) -> FloatArray:
    z = -eye / np.linalg.norm(eye)
    x = np.cross(z, (0.0, 0.0, 1.0))
    x /= np.linalg.norm(x)
    return np.asarray(se3(np.column_stack((x, np.cross(z, x), z)), eye))


def around(count: int) -> list[FloatArray]:
    """Cameras on a ring around the target."""
    turns = 2 * np.pi * np.arange(count) / count
    return [look_at(np.array([np.cos(a), np.sin(a), 0.7])) for a in turns]


def numpy_step() -> Block:
    """What one writes first: matrices as in a textbook."""
    rng = np.random.default_rng(0)
    F, identity = np.eye(12), np.eye(12)
    F[:6, 6:] = PERIOD * np.eye(6)
    Q, R = np.diag([1e-9] * 6 + [1e-5] * 6), 1e-6 * np.eye(16)
    H = np.hstack((rng.standard_normal((16, 6)), np.zeros((16, 6))))
    P, x, z = np.diag([1e-4] * 6 + [1e-2] * 6), np.zeros(12), 1e-3 * rng.standard_normal(16)

    def step() -> FloatArray:
        predicted, covariance = F @ x, F @ P @ F.T + Q
        S = H @ covariance @ H.T + R
        K = np.linalg.solve(S, H @ covariance).T
        left = identity - K @ H
        updated = left @ covariance @ left.T + K @ R @ K.T
        return np.asarray(predicted + K @ (z - H @ predicted) + updated[0, 0])

    return calls(step)


@njit
def linear_steps(count, P, velocity, rows):  # type: ignore[no-untyped-def]
    """Prediction and update of the covariance with the measurement matrix given."""
    total = 0.0
    for _ in range(count):
        predicted = predict_covariance(P, velocity, PERIOD, DENSITY)
        reduced = rows.copy()
        total += compress(reduced)
        correction, _, _ = joseph_update(predicted, reduced)
        total += correction[0]
    return total


@njit
def whole_steps(count, T, velocity, P, C, points, measured, covariance):  # type: ignore[no-untyped-def]
    """The same with motion on SE(3), projection, Jacobian, gates and correction of the pose."""
    total = 0.0
    for _ in range(count):
        pose = moved_pose(T, PERIOD * velocity)
        predicted = predict_covariance(P, velocity, PERIOD, DENSITY)
        found = correct(pose, velocity, predicted, C, points, measured, covariance, GATE)
        total += found.T_world_target[0, 3]
    return total


def filter_steps() -> tuple[Block, Block]:
    """Our steps inside a kernel: matrices given, and everything."""
    rng = np.random.default_rng(0)
    P, velocity = np.diag([1e-4] * 6 + [1e-2] * 6), np.full(6, 1e-3)
    rows = np.hstack((rng.standard_normal((16, 6)) * 1e3, rng.standard_normal((16, 1))))
    C = np.ascontiguousarray(se3_inverse(around(1)[0]))
    seen = transform_points(C, BOX.points)
    arguments = (
        np.eye(4),
        velocity,
        P,
        np.tile(C, (8, 1, 1)),
        np.array(BOX.points),
        seen[:, :2] / seen[:, 2:],
        np.tile(np.eye(2) / CAMERA.fx**2, (8, 1, 1)),
    )
    return (
        loops(lambda count: linear_steps(count, P, velocity, rows)),
        loops(lambda count: whole_steps(count, *arguments)),
    )


def many_cameras(count: int, features: int) -> tuple[Callable[[], object], Callable[[], object]]:
    """Visibility, and the selection of 8, for so many cameras and corners of four boxes."""
    boxes = [
        BOX.surface.triangles + np.array([0.2 * k - 0.3, 0.0, 0.0]) for k in range(features // 8)
    ]
    points = np.vstack(
        [BOX.points + np.array([0.2 * k - 0.3, 0.0, 0.0]) for k in range(len(boxes))]
    )
    vertices = np.vstack(boxes).reshape(-1, 3)
    shape = TargetShape.from_mesh(points, vertices, np.arange(len(vertices)).reshape(-1, 3))
    rig = CameraRig.of({f"camera{n}": CAMERA for n in range(count)}, 0.5)
    T_camera_world = np.array([se3_inverse(pose) for pose in around(count)])
    seen = predict_visibility(shape, T_camera_world, rig.lenses)
    candidates = Candidates(
        np.ones((count, features), dtype=np.bool_),  # the worst case: everything may be chosen
        seen.points_px,
        shape.points,
        np.tile(np.eye(4), (count, 1, 1)),
        T_camera_world,
        np.full((count, 2), 0.5 / CAMERA.fx),
        np.full(count, 960.0),
        np.diag([1e-5] * 3 + [1e-3] * 3),
        np.zeros((count, features), dtype=np.bool_),
    )
    selection = InformationSelection()
    return (
        lambda: predict_visibility(shape, T_camera_world, rig.lenses),
        lambda: selection.choose(candidates, 8),
    )


def exact_measure(places: dict[str, FloatArray]) -> Callable[..., ImagePoints]:
    """An extractor that costs next to nothing: what is timed is all the rest."""
    covariance = np.tile(0.25 * np.eye(2), (32, 1, 1))

    def measure(frame: Frame, features: IntArray, *_: FloatArray) -> ImagePoints:
        count = len(features)
        found = np.ones(count, dtype=np.bool_)
        where = places[frame.camera][features]
        return ImagePoints(
            frame.camera, frame.time, where, covariance[:count], found, ("",) * count
        )

    return measure


def frames(count: int, exposed: float) -> tuple[Frame, ...]:
    """What drivers deliver: an image of each camera."""
    return tuple(Frame(f"camera{n}", exposed, None, {}) for n in range(count))


def tick(count: int) -> Block:
    """Predict, see, select, open windows, update: from an image of each camera to an observation.

    8 features are measured in all. The images are made before.
    """
    names = [f"camera{n}" for n in range(count)]
    poses = dict(zip(names, around(count), strict=True))
    places = {
        name: CAMERA.project(transform_points(se3_compose(se3_inverse(T), np.eye(4)), BOX.points))
        for name, T in poses.items()
    }
    filter_ = PoseFilter()
    perception = PosePerception(
        CameraRig.of(dict.fromkeys(names, CAMERA), 0.5),
        BOX,
        lambda name, _: poses[name],
        exact_measure(places),
        filter_,
        filter_.start(0.0, np.eye(4)),
    )
    tick = 0

    def block(calls: int) -> float:
        nonlocal tick
        images = [frames(count, (tick + k + 1) * PERIOD) for k in range(calls)]
        tick += calls
        start = time.process_time()
        for each in images:
            perception.observe(each)
        return (time.process_time() - start) / calls

    return block


def seen_mesh(count: int) -> Callable[[], object]:
    """Visibility of a box for so many cameras, its faces divided into a fine mesh."""
    cells = 20
    fine = [
        a + np.array([[i, j], [i + 1, j], [i, j + 1]]) / cells @ np.array([b - a, c - a])
        for a, b, c in BOX.surface.triangles
        for i in range(cells)
        for j in range(cells - i)
    ]
    vertices = np.vstack(fine)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    shape = TargetShape.from_mesh(BOX.points, vertices, faces)
    rig = CameraRig.of({f"camera{n}": CAMERA for n in range(count)}, 0.5)
    poses = np.array([se3_inverse(pose) for pose in around(count)])
    return lambda: predict_visibility(shape, poses, rig.lenses)


def run() -> list[dict[str, Any]]:
    linear, whole = filter_steps()
    filterpy = python_peer("filterpy", SOURCES / "filterpy_step.py", "step")
    see, select = many_cameras(64, 32)
    see_few, select_few = many_cameras(2, 32)
    see_mesh = seen_mesh(4)
    step, sixty_four = tick(4), tick(64)
    return [
        row("filter: 12 states, 16 measurements, linear", linear, filterpy, ratio_aim=0.04),
        row("filter: the same, plain NumPy as peer", linear, Peer("NumPy", numpy_step())),
        row("filter: with SE(3), projection and gates", whole, filterpy),
        row("selection: 8 of 64 cameras x 32 features", calls(select), unit="us"),
        row("selection: 8 of 2 cameras x 32 features", calls(select_few), unit="us"),
        row("visibility: 64 cameras x 32 features", calls(see), unit="us"),
        row("visibility: 2 cameras x 32 features", calls(see_few), unit="us"),
        row(
            "visibility: 4 cameras x 8 corners, a mesh of 2 520 triangles",
            calls(see_mesh),
            unit="us",
        ),
        row(
            "estimation: images of 64 cameras, as drivers make them", calls(lambda: frames(64, 0.0))
        ),
        row("estimation tick: 4 cameras, 8 features", step, value_aim=200.0),
        row(
            "estimation tick: 64 cameras, 8 features",
            sixty_four,
            Peer("4 cameras", step),
            ratio_aim=2.0,
            round_seconds=0.05,
        ),
    ]
