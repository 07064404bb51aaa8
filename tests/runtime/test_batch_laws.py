"""Laws on points and poses, and their sums, come in the batch to what they come to in the loop."""

from dataclasses import replace

import numpy as np
import pytest
from test_batch import AXES, CAMERA, check_ends, check_same, drawn_run

from vergence.arrays import FloatArray
from vergence.control import (
    AdaptiveGain,
    CameraVelocity,
    CarriedDepth,
    DampedPseudoInverse,
    DepthFromFeatures,
    DepthFromMotion,
    HeldDepth,
    ImageBased,
    Limits,
    MotionSettings,
    Objective,
    OptimalTracking,
    PointPose,
    Posture,
    PseudoInverse,
    QuadraticProgram,
    Servo,
    Situation,
    Solver,
    Term,
)
from vergence.control.limits import COLUMNS, HALF, MIDDLE, RADIUS
from vergence.control.solvers import Obstacles
from vergence.estimation.feature_faces import FeatureFaces
from vergence.experiments.batch import KinematicRun, covers, run_batch
from vergence.features import Centre, LogDepth, Points, Segments
from vergence.geometry import so3_exp
from vergence.robot import Arm
from vergence.simulation import KinematicDriver

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 0.08


def drawn_law_run(seed: int) -> KinematicRun:
    """Draw a run as `drawn_run` does, with any other law on any points."""
    rng, drawn = np.random.default_rng([seed, 17]), drawn_run(seed)
    count = int(rng.integers(4, 7)) if seed % 4 else int(rng.integers(1, 4))
    features = SQUARE if seed % 3 == 0 else rng.uniform(-0.1, 0.1, (6, 3))
    cell = replace(drawn.cell, features=features[:count])
    truth = KinematicDriver(cell).frame().truth
    assert truth is not None
    believed_m = truth.depth_m * float(np.exp(rng.uniform(-0.4, 0.4)))
    constrained = bool(rng.integers(0, 2))
    law = Servo(
        cell.arm,
        CAMERA,
        drawn_objectives(rng, cell.arm.joint_count),
        solver=drawn_solver(rng, constrained),
        limits=drawn_limits(rng) if constrained else None,
        depth_m=believed_m,
        situation=Situation(
            1.0 / cell.rate_hz,
            drawn_motion(rng, len(cell.features)),
            drawn_obstacles(rng, cell.target(np.zeros(1))[0, :3, 3]),
            start=cell.start,
            features={"": cell.features},
            faces={"": FeatureFaces.of_points(cell.features)} if rng.integers(0, 2) else {},
        ),
    )
    turn = so3_exp(np.array([0.0, 0.0, rng.choice([0.0, 0.3, 2.0])]))[:2, :2]
    middle = truth.points_px.mean(axis=0)
    desired = middle + (truth.points_px - middle) @ turn.T + rng.normal(0, 40, 2)
    depth_m = truth.depth_m * rng.uniform(0.8, 1.2) if rng.integers(0, 2) else None
    return replace(drawn, cell=cell, law=law, desired_px=desired, desired_depth_m=depth_m)


def drawn_objectives(rng: np.random.Generator, joint_count: int) -> list[Term]:
    """Draw one objective, or a sum of several with weights, such as [Malis1999]."""
    if rng.random() < 0.5:
        return [Term(drawn_objective(rng))]
    gain = float(rng.uniform(0.5, 8.0))
    if rng.random() < 0.4:
        stack = [
            Term(ImageBased(gain=gain, feature=Centre)),
            Term(ImageBased(gain=gain, feature=LogDepth)),
            Term(PointPose(gain=gain, axes=("rx", "ry", "rz"))),
        ]
    else:
        stack = [
            Term(drawn_objective(rng), float(rng.uniform(0.1, 3.0)))
            for _ in range(rng.integers(1, 3))
        ]
        feature = (Points, Centre, LogDepth)[rng.integers(0, 3)]
        stack.append(Term(ImageBased(gain=gain, feature=feature), float(rng.uniform(0.1, 3.0))))
    middle = None if rng.integers(0, 2) else tuple(rng.uniform(-1.0, 1.0, joint_count).tolist())
    pull = Term(Posture(gain=gain, position=middle, strength=1e-3), 2.0)
    return [*stack, pull] if rng.random() < 0.4 else stack


def drawn_objective(rng: np.random.Generator) -> Objective:
    kind, value = rng.random(), float(rng.uniform(0.5, 8.0))
    gain = value if rng.integers(0, 2) else AdaptiveGain(2.0 * value, 0.5 * value, 20.0)
    if kind < 0.2:
        return OptimalTracking(axes=AXES, Q=2e-5, R=1.0)
    if kind < 0.5:
        axes = rng.choice(AXES, rng.integers(2, 7), replace=False)
        return PointPose(gain=gain, axes=AXES if rng.integers(0, 2) else tuple(map(str, axes)))
    interaction = str(rng.choice(["current", "desired", "mean"]))
    return ImageBased(gain=gain, interaction=interaction)


def drawn_solver(rng: np.random.Generator, constrained: bool) -> Solver:
    if constrained:
        return QuadraticProgram(S=float(rng.choice([0.0, 1e-4])))
    kind = DampedPseudoInverse if rng.random() < 0.3 else PseudoInverse
    return kind(singular_below=float(rng.choice([1e-4, 0.05])))


def drawn_limits(rng: np.random.Generator) -> Limits | None:
    order = rng.permutation(["view", "occlusion", "singularity", "joint margin"])
    if rng.random() < 0.3:
        return None
    return Limits(
        order=tuple(str(name) for name in order[: rng.integers(1, 5)]),
        manipulability_share=float(rng.choice([0.0, 0.9])),
        depth_range=(0.7, 1.4) if rng.integers(0, 2) else None,
    )


def drawn_motion(rng: np.random.Generator, count: int) -> MotionSettings:
    depths = [HeldDepth(), CarriedDepth(), *([DepthFromFeatures()] if count >= 4 else [])]
    if rng.random() < 0.25:
        return MotionSettings(False, False)
    return MotionSettings(
        bool(rng.integers(0, 2)),
        bool(rng.integers(0, 2)),
        float(rng.choice([0.0, 0.2])),
        depths[rng.integers(0, len(depths))],
    )


def drawn_obstacles(rng: np.random.Generator, target: FloatArray) -> Obstacles | None:
    """A ball near the target, which may come between."""
    solid = np.zeros((1, COLUMNS))
    solid[0, :9] = np.eye(3).ravel()
    solid[0, MIDDLE:HALF] = target + rng.normal(0.0, 0.3, 3)
    solid[0, RADIUS] = 0.05
    return (lambda: solid) if rng.integers(0, 2) else None


RUNS = [drawn_law_run(seed) for seed in range(240)]


@pytest.fixture(scope="module")
def traces():
    assert all(covers(run) for run in RUNS)
    return run_batch(RUNS)


@pytest.mark.parametrize("number", range(len(RUNS)))
def test_a_run_of_the_batch_is_the_run_of_the_loop(traces, number: int) -> None:
    check_same(traces[number], RUNS[number].in_loop())


def test_the_runs_end_in_every_way(traces) -> None:
    check_ends(traces)


class StandStill:
    """A limit of a user's own."""

    def rows(
        self, arm: Arm, _q: FloatArray, _velocity: FloatArray, _period_s: float
    ) -> tuple[FloatArray, FloatArray]:
        return -np.eye(arm.joint_count), np.zeros(arm.joint_count)


@pytest.mark.parametrize(
    ("objectives", "solver", "limits", "depth"),
    [
        (ImageBased(feature=Segments), PseudoInverse(), None, HeldDepth()),
        (ImageBased(feature=Centre), PseudoInverse(), None, HeldDepth()),
        ([ImageBased(), CameraVelocity()], QuadraticProgram(), None, HeldDepth()),
        (ImageBased(), QuadraticProgram(), Limits(own=(StandStill(),)), HeldDepth()),
        (ImageBased(), QuadraticProgram(), None, DepthFromMotion()),
        (OptimalTracking(measure="absolute", S=1e-3), PseudoInverse(), None, HeldDepth()),
        (OptimalTracking(S=1e-3), QuadraticProgram(), None, HeldDepth()),
    ],
)
def test_a_law_that_the_kernel_does_not_know_is_left_to_the_loop(
    objectives, solver, limits, depth
) -> None:
    run = RUNS[0]
    situation = Situation(motion=MotionSettings(False, True, 0.2, depth), start=run.cell.start)
    law = Servo(
        run.cell.arm, CAMERA, objectives, solver=solver, limits=limits, depth_m=1.0,
        situation=situation,
    )  # fmt: skip
    assert covers(run)
    assert not covers(replace(run, law=law))
