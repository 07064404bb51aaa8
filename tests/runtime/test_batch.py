"""The batch kernel comes to what the loop comes to, run by run."""

from collections import Counter

import numpy as np
import pytest

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.control import (
    MotionSettings,
    OptimalTracking,
    PseudoInverse,
    Servo,
    Situation,
)
from vergence.experiments.batch import BatchTrace, KinematicRun, run_batch
from vergence.geometry import se3, so3_exp
from vergence.runtime import Run
from vergence.signals import OutcomeKind
from vergence.simulation import KinematicCell, KinematicDriver
from vergence.simulation.kinematic_driver import CAMERA as CAMERA_NAME
from vergence.studies.guarantees.runs import arms

CAMERA = Camera(640, 480, 600.0, 580.0, 319.5, 239.5)
ARMS = arms()  # six turning joints, seven with a track, three sliding and three turning
AXES = ("x", "y", "z", "rx", "ry", "rz")


def drawn_run(seed: int) -> KinematicRun:
    """Draw a run: any arm, start, motion, delay, noise and belief; some of them hopeless."""
    rng = np.random.default_rng([seed, 7])
    arm = ARMS[seed % len(ARMS)]
    low, high = np.maximum(arm.q_min, -np.pi), np.minimum(arm.q_max, np.pi)
    start = low + rng.uniform(0.02, 0.98, arm.joint_count) * (high - low)
    T_camera_target = se3(so3_exp(rng.uniform(-0.4, 0.4, 3)), np.zeros(3))
    T_camera_target[:3, 3] = [*rng.uniform(-0.1, 0.1, 2), rng.uniform(0.5, 1.5)]
    T_start = arm.forward_kinematics(start) @ T_camera_target
    velocity = rng.normal(size=3)
    velocity *= 10.0 ** rng.uniform(-2, 0.3) / np.linalg.norm(velocity)

    def target(times: FloatArray) -> FloatArray:
        poses = np.tile(T_start, (len(times), 1, 1))
        poses[:, :3, 3] += np.outer(times, velocity)
        return poses

    count = int(rng.integers(1, 5))
    cell = KinematicCell(
        arm,
        CAMERA,
        start,
        target,
        np.column_stack((rng.uniform(-0.1, 0.1, (count, 2)), np.zeros(count))),
        rate_hz=float(rng.choice([26.0, 30.0])),
        inner_rate_hz=float(rng.choice([120.0, 500.0])),
        latency_frames=int(rng.integers(0, 4)),
        dropped=float(rng.choice([0.0, 0.3, 0.99], p=[0.6, 0.3, 0.1])),
        seed=seed,
    )
    truth = KinematicDriver(cell).frame().truth
    assert truth is not None
    axes = tuple(str(a) for a in rng.choice(AXES, rng.integers(2, 7), replace=False))
    depth_factor = float(np.exp(rng.uniform(-0.7, 0.7)))
    objective = OptimalTracking(
        axes=axes,
        Q=2e-6 * count,  # it is shared by the features
        avoidance_axes=axes[: rng.integers(0, len(axes) + 1)],
        S=float(rng.choice([0.0, 1e-3])),
        penalty=str(rng.choice(["product", "per_joint"])),
        penalty_k=float(rng.choice([50.0, 1e5])),
    )
    law = Servo(
        arm,
        CAMERA,
        objective,
        solver=PseudoInverse(singular_below=float(rng.choice([1e-4, 0.05]))),
        depth_m=truth.depth_m * depth_factor,
        situation=Situation(1.0 / cell.rate_hz, MotionSettings(False, False)),
    )
    desired = truth.points_px + rng.normal(0, 30, 2)
    noise_px = float(rng.choice([0.0, 0.5]))
    duration_s = 3.0 if seed % 2 else float(rng.uniform(2.9, 3.0))  # at an image, or between two
    return KinematicRun(cell, law, desired, duration_s, noise_px=noise_px)


def check_same(trace: BatchTrace, run: Run) -> None:
    assert trace.outcome == run.outcome
    camera = run.cameras[CAMERA_NAME]
    looped = {
        "position": run.arms["arm"].position,
        "velocity": run.arms["arm"].setpoint_rate,
        "times": camera.time,
        "points_px": camera.true_px,
        "camera_m": camera.T_world_camera[:, :3, 3],
        "target_m": camera.T_world_target[:, :3, 3],
    }
    for name, desired in looped.items():
        given = getattr(trace, name)
        if desired.size or given.size:
            np.testing.assert_allclose(given, desired, rtol=1e-9, atol=1e-9, err_msg=name)


RUNS = [drawn_run(seed) for seed in range(120)]


@pytest.fixture(scope="module")
def traces() -> list[BatchTrace]:
    return run_batch(RUNS)


@pytest.mark.parametrize("number", range(len(RUNS)))
def test_a_run_of_the_batch_is_the_run_of_the_loop(traces, number: int) -> None:
    check_same(traces[number], RUNS[number].in_loop())


def check_ends(traces: list[BatchTrace]) -> None:
    """Runs are drawn so that they end in every way."""
    kinds = Counter(trace.outcome.kind for trace in traces)
    assert kinds.keys() == {
        OutcomeKind.COMPLETED,
        OutcomeKind.IMAGE_LATE,
        OutcomeKind.JOINT_LIMIT,
        OutcomeKind.SINGULARITY,
        OutcomeKind.TARGET_LOST,
    }
    assert min(kinds.values()) >= 3


def test_the_runs_end_in_every_way(traces) -> None:
    check_ends(traces)


def test_one_core_and_all_of_them_find_the_same(traces) -> None:
    for alone, together in zip(run_batch(RUNS[:20], threads=1), traces, strict=False):
        assert alone.outcome == together.outcome
        np.testing.assert_array_equal(alone.position, together.position)
