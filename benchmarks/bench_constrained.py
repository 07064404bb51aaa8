"""One constrained tick: six and seven joints, four and nine points, every constraint in force.

The peers do less: ViSP changes its law at joint limits, which it may pass; mink and pink hold joint
positions and rates while the flange goes to a pose, and know of no image.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from harness import calls, loops, row
from peer_programs import mink, pink, visp
from vergence.arrays import FloatArray
from vergence.cell import load_cell
from vergence.control import CameraMounting, Limits
from vergence.control.limits import AXES, COLUMNS, HALF, MIDDLE, ConstraintSettings, pack_features
from vergence.control.limits._rows import DEPTH
from vergence.control.objectives.objective import least_squares_kernel
from vergence.control.solvers import Setting
from vergence.control.solvers._constrained_rates import (
    Avoidance,
    Scene,
    Task,
    constrained_rates,
)
from vergence.control.solvers.quadratic_program import constraint_settings
from vergence.features import interaction_matrix_points
from vergence.robot import Arm, yoshikawa_measure
from vergence.simulation import SimulatedDriver

GAIN, PERIOD = 2.0, 1 / 30


class Tick(NamedTuple):
    """What one tick is made from; the same every time."""

    arm: Arm
    settings: ConstraintSettings
    q: FloatArray
    desired: FloatArray
    features: FloatArray
    solids: FloatArray


def tick_of(cell: str, count: int, posts: int = 0) -> Tick:
    """Make a tick in which a corner of the image, a soft joint limit, and posts are near."""
    driver = SimulatedDriver(load_cell(cell), images=False)
    task = driver.cell.task
    arm, camera = driver.world.arm_to_camera(task.camera), driver.cameras[task.camera]
    q = np.array(driver.read().joints[task.arm].position)
    side = int(np.ceil(np.sqrt(count)))
    grid = np.linspace(-0.09, 0.13, side)
    points = np.array([(x, y) for x in grid for y in grid])[:count]
    depth = np.linspace(0.9, 1.1, count)
    lowest = 0.5 * yoshikawa_measure(arm.jacobian(q))
    setting = Setting(arm, CameraMounting(camera), None, PERIOD)
    settings = constraint_settings(setting, Limits())._replace(manipulability_min=lowest)
    features = pack_features(points, np.zeros_like(points), depth)
    desired = points + np.array([0.06, -0.04])
    return Tick(arm, settings, q, desired, features, beside(arm.forward_kinematics(q), posts))


def beside(T_world_camera: FloatArray, count: int) -> FloatArray:
    """Return posts of 4 cm half a metre before the camera, to its left and right in turn."""
    posts = np.zeros((count, COLUMNS))
    posts[:, AXES:MIDDLE] = T_world_camera[:3, :3].ravel()
    for i, post in enumerate(posts):
        aside = np.array([(-1.0) ** i * (0.12 + 0.05 * i), 0.0, 0.5])
        post[MIDDLE:HALF] = T_world_camera[:3, :3] @ aside + T_world_camera[:3, 3]
        post[HALF:] = 0.0, 0.5, 0.0, 0.02
    return posts


@njit
def one_tick(chain, limits, q, desired, features, solids, R, settings, avoidance):  # type: ignore[no-untyped-def]
    """From features and joints to joint rates, image-based under every constraint."""
    points = features[:, :2]
    L = interaction_matrix_points(points, features[:, DEPTH])
    error = (-GAIN * (points - desired)).ravel()
    twist = least_squares_kernel(L, error, np.ones(len(L)), R)
    n = len(q)
    rest, none = np.zeros(n), np.empty((0, 0))
    task = Task(twist.H, twist.g, none, np.empty(0), rest, np.full(n, 1e-6))
    scene = Scene(
        features, solids, none, np.eye(4), np.empty((0, n)), np.empty(0),
        np.empty(0, dtype=np.int64),
    )  # fmt: skip
    return constrained_rates(
        chain,
        limits,
        q,
        rest,
        task,
        scene,
        PERIOD,
        settings,
        avoidance,
    ).rates


@njit
def repeat(count, chain, limits, q, desired, features, solids, R, settings, avoidance):  # type: ignore[no-untyped-def]
    q, total = q.copy(), 0.0
    for _ in range(count):
        q[0] += 1e-9
        total += one_tick(chain, limits, q, desired, features, solids, R, settings, avoidance)[0]
    return total


def arguments(tick: Tick) -> tuple[Any, ...]:
    arm, R = tick.arm, np.full(6, 1e-6)
    limits = np.vstack((arm.q_min, arm.q_max, arm.rate_max, arm.acceleration_max))
    before = (arm.chain, limits, tick.q, tick.desired, tick.features, tick.solids, R)
    return (*before, tick.settings, Avoidance(1e-3, 0.5, 50.0))


def from_python(tick: Tick) -> Callable[[], object]:
    packed = arguments(tick)
    return lambda: one_tick(*packed)


def run() -> list[dict[str, Any]]:
    rows = []
    cases = (("puma560", 6, 4, 0), ("puma560", 6, 9, 0), ("lippiello2005", 7, 9, 0),
             ("puma560", 6, 4, 2), ("lippiello2005", 7, 9, 2))  # fmt: skip
    for cell, joints, count, posts in cases:
        tick = tick_of(cell, count, posts)
        packed = arguments(tick)
        name = f"constrained tick: {joints} joints, {count} points"
        if posts:
            name += f", {posts} posts beside the lines of sight"
        ours = calls(from_python(tick))
        compared = count == 4 and not posts
        peers = [visp("tick_joint_limits"), mink(), pink()] if compared else [None]
        rows += [row(name, ours, peer, value_aim=12.0) for peer in peers]
        inside = loops(lambda n, packed=packed: repeat(n, *packed))
        rows.append(row(f"{name}, inside a kernel", inside, value_aim=8.0))
    return rows
