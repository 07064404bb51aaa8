"""Random closed-loop runs that try to make an arm pass its limits."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.cell import load_cell
from vergence.control import (
    CameraMounting,
    DampedPseudoInverse,
    ImageBased,
    Law,
    Limits,
    MotionSettings,
    Objective,
    OptimalTracking,
    PoseServo,
    PositionBased,
    PseudoInverse,
    QuadraticProgram,
    Servo,
    Situation,
)
from vergence.geometry import se3, se3_inverse, so3_exp
from vergence.planning import FixedReference
from vergence.robot import Arm, Clearance
from vergence.runtime import DriverWrapper, Loop, RunInfo, RunRecorder
from vergence.runtime.stages import Planner
from vergence.signals import FrameTruth, Outcome, Reference, Setpoint
from vergence.simulation import ExactPoints, KinematicCell, KinematicDriver
from vergence.simulation.kinematic_driver import ARM, CAMERA
from vergence.studies.guarantees.wrong_beliefs import MovingGoal, WrongDepthPose

CAMERA_MODEL = Camera(640, 480, 600.0, 600.0, 319.5, 239.5)
LAWS = (
    "plain",
    "optimal tracking",
    "position-based",
    "path tracking",
    "constrained image-based",
    "constrained tracking",
    "constrained position-based",
    "constrained path tracking",
)
# Six turning joints, seven with a track, three that slide and three that turn, six, seven.
CELLS = ("puma560", "lippiello2005", "gantry", "ur5", "panda")
RUN_S = 2.0
LIMITS = Limits(manipulability_share=0.0, joint_margin=0.03)  # a random start may be singular


class Excess(NamedTuple):
    """How far a run went past limits at worst; negative or zero if it never did."""

    position: float  # rad or m
    rate: float  # rad/s or m/s


class Watched(DriverWrapper):
    """A driver that looks at every set-point on its way.

    Args:
        driver: the one that moves.
        arm: whose limits count.
    """

    def __init__(self, driver: KinematicDriver, arm: Arm) -> None:
        super().__init__(driver)
        self._arm = arm
        self.excess = Excess(-np.inf, -np.inf)

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Note by how much a set-point passes a limit, then let it through."""
        q, rate = setpoints[ARM].position, setpoints[ARM].velocity
        beyond = np.maximum(q - self._arm.q_max, self._arm.q_min - q).max()
        too_fast = (np.abs(rate) - self._arm.rate_max).max()
        nan = np.isnan(q).any() or np.isnan(rate).any()
        worst = (np.inf, np.inf) if nan else (float(beyond), float(too_fast))
        self.excess = Excess(max(self.excess[0], worst[0]), max(self.excess[1], worst[1]))
        super().step(setpoints)


@dataclass(frozen=True, slots=True)
class Attempt:
    """A run that is to be tried."""

    cell: KinematicCell
    law: str
    depth_factor: float  # believed over true
    offset_px: FloatArray  # (2,) of the goal from the start

    def run(self, duration_s: float = RUN_S) -> tuple[Excess, Outcome]:
        """Run it; return what was exceeded and how it ended."""
        return run_ideal(self.cell, self.law, duration_s, self.depth_factor, self.offset_px)


def run_ideal(
    cell: KinematicCell,
    law: str,
    duration_s: float,
    depth_factor: float = 1.0,
    offset_px: FloatArray | None = None,
    recorder: RunRecorder | None = None,
) -> tuple[Excess, Outcome]:
    """Run the real loop on an ideal cell, features desired where they are at the start."""
    driver = KinematicDriver(cell)
    truth = driver.frame().truth
    assert truth is not None
    offset = np.zeros(2) if offset_px is None else offset_px
    depth = truth.depth_m * depth_factor
    watched = Watched(driver, cell.arm)
    loop = Loop(
        watched,
        ARM,
        WrongDepthPose(CAMERA, depth_factor) if "position" in law else ExactPoints(CAMERA),
        goal(law, truth, offset, depth),
        build(law, cell, depth),
        outer_rate_hz=cell.rate_hz,
        listeners=[] if recorder is None else [recorder],
    )
    if recorder is not None:
        recorder.begin(RunInfo.of(watched, law, "", cell.seed, CAMERA))
    outcome = loop.run(duration_s)
    if recorder is not None:
        recorder.close(outcome, {})
    return watched.excess, outcome


def goal(law: str, truth: FrameTruth, offset_px: FloatArray, depth: FloatArray) -> Planner:
    """Return what a law aims at: points beside the first, those on the way on, or a pose."""
    desired = truth.points_px + offset_px
    T_camera_target = se3_inverse(truth.T_world_camera) @ truth.T_world_target
    T_camera_target[:2, 3] += offset_px / CAMERA_MODEL.focal_px * T_camera_target[2, 3]
    if "path" in law:
        return MovingGoal(desired, offset_px, depth, T_camera_target)
    return FixedReference(Reference(0.0, desired, T_camera_target=T_camera_target))


def build(
    law: str, cell: KinematicCell, depth: FloatArray, clearance: Clearance | None = None
) -> Law:
    """Make one of `LAWS`; the constrained ones keep a clearance, if one is given."""
    if "position-based" in law:
        return _pose_servo(law, cell, clearance)
    arm, camera, period = cell.arm, cell.camera, 1.0 / cell.rate_hz
    as_it_is = MotionSettings(feed_forward=False, prediction=False)
    match law:
        case "plain":
            stationary = Situation(period, MotionSettings(feed_forward=False))
            solver = PseudoInverse(singular_below=0.0)
            return Servo(
                arm, camera, ImageBased(gain=2.0), solver=solver, depth_m=depth,
                situation=stationary,
            )  # fmt: skip
        case "optimal tracking":
            tracking = OptimalTracking(
                axes=("x", "y", "rx", "ry"), avoidance_axes=("x", "y"), Q=8e-6, S=1e-3
            )
            solver = PseudoInverse(singular_below=1e-4)
            return Servo(
                arm, camera, tracking, solver=solver, depth_m=depth,
                situation=Situation(period, as_it_is),
            )  # fmt: skip
        case "path tracking":
            return Servo(
                arm, camera, ImageBased(gain=2.0, interaction="desired"),
                solver=DampedPseudoInverse(singular_below=1e-2), depth_m=depth,
                situation=Situation(period, as_it_is, fewest=3),
            )  # fmt: skip
    objectives: dict[str, Objective] = {
        "constrained image-based": ImageBased(gain=2.0),
        "constrained path tracking": ImageBased(gain=2.0, interaction="desired"),
        # Depth is free as well: where the arm has to look back over its base it moves up.
        "constrained tracking": OptimalTracking(axes=("x", "y", "z", "rx", "ry"), Q=8e-6, R=1.0),
    }
    return Servo(
        arm, camera, objectives[law], limits=LIMITS, solver=QuadraticProgram(S=1e-3), depth_m=depth,
        situation=Situation(period, MotionSettings(feed_forward=True), clearance=clearance),
    )  # fmt: skip


def _pose_servo(law: str, cell: KinematicCell, clearance: Clearance | None) -> PoseServo:
    constrained = law.startswith("constrained")
    return PoseServo(
        cell.arm,
        CameraMounting(cell.camera),
        PositionBased(),
        limits=LIMITS if constrained else None,
        solver=QuadraticProgram() if constrained else DampedPseudoInverse(),
        corners=cell.features if constrained else None,
        situation=Situation(1.0 / cell.inner_rate_hz, depth_range=(0.9, 1.1), clearance=clearance),
    )


def arms() -> tuple[Arm, ...]:
    """Return the arms of `CELLS`, each up to a camera that it carries.

    Raises:
        InputError: if the models of the UR5 and the Panda are not installed, with how to do it.
    """
    from vergence.simulation import SimulatedDriver

    found = []
    for name in CELLS:
        cell = load_cell(name)
        driver = SimulatedDriver(cell, images=False)
        camera = next(c for c in cell.cameras if cell.cameras[c].arm == cell.task.arm)
        found.append(driver.world.arm_to_camera(camera))
        driver.close()
    return tuple(found)


def attempt(known: tuple[Arm, ...], seed: int) -> Attempt:
    """Draw an attempt: any arm, law and start, targets up to absurd speeds, bad beliefs."""
    rng = np.random.default_rng([seed, 5])
    arm = known[seed % len(known)]
    low, high = np.maximum(arm.q_min, -np.pi), np.minimum(arm.q_max, np.pi)
    start = low + rng.uniform(0.01, 0.99, arm.joint_count) * (high - low)
    T_camera_target = se3(so3_exp(rng.uniform(-0.5, 0.5, 3)), np.zeros(3))
    T_camera_target[:3, 3] = [*rng.uniform(-0.1, 0.1, 2), rng.uniform(0.4, 1.5)]
    T_start = arm.forward_kinematics(start) @ T_camera_target
    direction = rng.normal(size=3)
    velocity = direction / np.linalg.norm(direction) * 10.0 ** rng.uniform(-2, 1)

    def target(times: FloatArray) -> FloatArray:
        T = np.tile(T_start, (len(times), 1, 1))
        T[:, :3, 3] += np.outer(times, velocity)
        return T

    features = np.column_stack((rng.uniform(-0.1, 0.1, (4, 2)), np.zeros(4)))
    cell = KinematicCell(
        arm,
        CAMERA_MODEL,
        start,
        target,
        features,
        latency_frames=int(rng.integers(0, 5)),
        dropped=float(rng.choice([0.0, 0.3])),
        seed=seed,
    )
    law = LAWS[(seed // len(known)) % len(LAWS)]
    return Attempt(
        cell, law, float(np.exp(rng.uniform(np.log(0.3), np.log(3)))), rng.normal(0, 60, 2)
    )


def joint_path(
    cell: KinematicCell, q_end: FloatArray, duration_s: float, T_camera_target: FloatArray
) -> KinematicCell:
    """Return the cell with a target that is seen alike all along a straight way of the joints."""
    start, arm = cell.start, cell.arm

    def target(times: FloatArray) -> FloatArray:
        shares = 0.5 - 0.5 * np.cos(np.pi * np.clip(times / duration_s, 0.0, 1.0))
        poses = [arm.forward_kinematics(start + share * (q_end - start)) for share in shares]
        return np.array(poses) @ T_camera_target

    return replace(cell, target=target)


def facing(depth: float) -> FloatArray:
    """Return T_camera_target of a target that faces the camera at a depth, (4, 4)."""
    return se3_inverse(se3(so3_exp(np.array([np.pi, 0.0, 0.0])), np.array([0.0, 0.0, depth])))
