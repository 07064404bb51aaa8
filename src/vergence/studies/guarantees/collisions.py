"""Obstacles beside and across an arm's path: no set-point may touch any, whatever the law."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from vergence.arrays import FloatArray
from vergence.cell import load_cell
from vergence.experiments.workers import Workers
from vergence.geometry import matrix_to_quaternion, so3_exp
from vergence.robot import Arm
from vergence.runtime import DriverWrapper, Loop
from vergence.signals import OutcomeKind, Setpoint
from vergence.simulation import ExactPoints, KinematicCell, KinematicDriver
from vergence.simulation.cell_model import CellModel
from vergence.simulation.clearance import CellClearance
from vergence.simulation.kinematic_driver import ARM, CAMERA
from vergence.studies.check import Check, Others
from vergence.studies.guarantees.runs import CAMERA_MODEL, build, facing, goal, joint_path
from vergence.studies.guarantees.wrong_beliefs import WrongDepthPose

OBSTACLES = ("post", "ball", "block")
LAWS = ("plain", "constrained image-based", "constrained tracking", "constrained position-based")
CELLS = ("puma560", "gantry", "ur5", "panda")
MARGIN_M = 0.01
RUN_S, ALONG_S = 2.5, 1.5  # of a run, and of the target's motion in it
_BESIDE_M = 0.08  # up to which an obstacle is off the path of some link; at least across it
_FREE_M = 0.02  # least distance at the start
_FEATURES = np.array([[0.06, 0.06, 0], [-0.06, 0.06, 0], [-0.06, -0.06, 0], [0.06, -0.06, 0.0]])
_DEPTH_M = 0.5


class Encounter(NamedTuple):
    """What came of one run."""

    law: str
    least_m: float  # distance of any pair of bodies at any set-point; negative if they overlapped
    kind: OutcomeKind


class _Watched(DriverWrapper):
    """A driver that measures the distance of every pair at every set-point, by MuJoCo alone."""

    def __init__(self, driver: KinematicDriver, model: CellModel, clearance: CellClearance) -> None:
        super().__init__(driver)
        self._model, self._data = model, mujoco.MjData(model.model)
        self._data.qpos[:] = model.data.qpos
        self._pairs = clearance.geoms.tolist()
        self._arm = model.cell.task.arm
        self.least_m = np.inf

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Note how near any two bodies are, then let the set-point through."""
        m, data = self._model.model, self._data
        self._model.write_position(data, self._arm, setpoints[ARM].position)
        mujoco.mj_kinematics(m, data)
        for a, b in self._pairs:
            distance = mujoco.mj_geomDistance(m, data, a, b, 0.1, None)
            self.least_m = min(self.least_m, float(distance))
        super().step(setpoints)


class ObstacleScene(NamedTuple):
    """An arm among obstacles, and a way of its joints that leads beside or across them."""

    model: CellModel  # the arm at its start
    clearance: CellClearance
    start: FloatArray  # (n,)
    end: FloatArray  # (n,)


def law_of(index: int) -> str:
    """Return the law of a run."""
    return LAWS[index // len(CELLS) % len(LAWS)]


def draw_scene(seed: int, index: int) -> ObstacleScene:
    """Return the scene of a run; it holds until the next one of the same arm is drawn.

    Args:
        seed: names the set.
        index: names the run.
    """
    rng = np.random.default_rng([seed, index, 17])
    model = _model(CELLS[index % len(CELLS)])
    name = model.cell.task.arm
    arm = model.arms[name]
    low, high = np.maximum(arm.q_min, -np.pi), np.minimum(arm.q_max, np.pi)
    start, end = low + rng.uniform(0.1, 0.9, (2, arm.joint_count)) * (high - low)
    end = start + rng.uniform(0.2, 0.5) * (end - start)
    _put_beside(model, start, end, rng)
    model.place_arm(name, start)
    clearance = CellClearance(model, name, ("self", "fixtures"), MARGIN_M)
    return ObstacleScene(model, clearance, start, end)


def try_obstacles(seed: int, index: int, guarded: bool = True) -> Encounter:
    """Lead a camera along a random way of the joints, with obstacles beside or across it.

    Args:
        seed: names the set.
        index: names the run.
        guarded: whether law and guard know what may be touched.
    """
    model, clearance, start, end = draw_scene(seed, index)
    arm, law = model.arm_to_camera(model.cell.task.camera), law_of(index)
    cell = joint_path(_cell(arm, start), end, ALONG_S, facing(_DEPTH_M))
    ideal = KinematicDriver(cell)
    driver = _Watched(ideal, model, clearance)
    truth = ideal.frame().truth
    kept = clearance if guarded else None
    assert truth is not None
    loop = Loop(
        driver,
        ARM,
        WrongDepthPose(CAMERA, 1.0) if "position" in law else ExactPoints(CAMERA),
        goal(law, truth, np.zeros(2), truth.depth_m),
        build(law, cell, truth.depth_m, kept),
        outer_rate_hz=cell.rate_hz,
        clearance=kept,
    )
    kind = loop.run(RUN_S).kind
    return Encounter(law, driver.least_m, kind)


def collisions_check(
    count: int,
    seed: int,
    pool: Workers,
    progress: Callable[[float], None],
) -> Check:
    """Return the check: no set-point of any run brings two bodies together."""
    runs = pool.try_all(partial(try_obstacles, seed), count, progress)
    penetrations = sum(run.least_m <= 0.0 for run in runs)
    return Check(
        "collision.penetrations",
        "runs with a set-point at which bodies overlap: 0",
        penetrations,
        f"of {count} runs",
        penetrations == 0,
        f"a post, a ball and a block up to {100 * _BESIDE_M:.0f} cm beside the path of some link, "
        f"or across it; arms of {', '.join(CELLS)}; every pair measured at every set-point",
        others=Others(
            "Runs that the guard braked, and least distance, by law",
            tuple((law, _told([run for run in runs if run.law == law])) for law in LAWS),
        ),
    )


def _told(runs: Sequence[Encounter]) -> str:
    braked = Counter(run.kind for run in runs)[OutcomeKind.COLLISION]
    least = 1e3 * min((run.least_m for run in runs), default=np.nan)
    return f"{braked} of {len(runs)}, {least:.1f} mm"


@cache
def _model(name: str) -> CellModel:
    """Return the model of a cell's arm among the obstacles."""
    room = Path(__file__).with_name("obstacles.xml")
    return CellModel(load_cell(name).replace(scene={"model": str(room)}), hulls=True)


def _put_beside(
    model: CellModel, start: FloatArray, end: FloatArray, rng: np.random.Generator
) -> None:
    """Put each obstacle beside the path of some link, away from the arm at the start."""
    m, data, name = model.model, model.data, model.cell.task.arm
    bodies = model.bodies_of(name)
    links = [
        geom
        for geom in range(m.ngeom)
        if int(m.geom_bodyid[geom]) in bodies and m.body_weldid[m.geom_bodyid[geom]] > 0
    ]
    for obstacle in OBSTACLES:
        geom = int(m.geom(f"scene/{obstacle}").id)
        turn = so3_exp(rng.uniform(-np.pi, np.pi, 3))
        m.geom_quat[geom] = matrix_to_quaternion(np.ascontiguousarray(turn))
        for _ in range(20):
            link, share = int(rng.choice(links)), rng.uniform(0.3, 1.0)
            model.place_arm(name, start + share * (end - start))
            direction = rng.normal(size=3)
            off = rng.uniform(0.0, _BESIDE_M) + 0.5 * m.geom_rbound[link]
            m.geom_pos[geom] = data.geom_xpos[link] + off * direction / np.linalg.norm(direction)
            model.place_arm(name, start)
            if _distance(model, geom, links) > _FREE_M:
                break
        else:
            m.geom_pos[geom] = (0.0, 0.0, -20.0)  # no room for it beside this arm


def _distance(model: CellModel, obstacle: int, links: Sequence[int]) -> float:
    m, data = model.model, model.data
    return min(float(mujoco.mj_geomDistance(m, data, obstacle, g, 0.1, None)) for g in links)


def _cell(arm: Arm, start: FloatArray) -> KinematicCell:
    T_target = arm.forward_kinematics(start) @ facing(_DEPTH_M)
    return KinematicCell(
        arm, CAMERA_MODEL, start, lambda times: np.tile(T_target, (len(times), 1, 1)), _FEATURES
    )
