"""The collision limit: a tick with ten pairs near, and how often bodies overlap among obstacles.

Both sides get the same model, pairs, margin and range, and both measure by `mj_geomDistance`. On
the paths our servo follows a target by position, acceleration limits kept and the guard behind
it; mink's task is the same pose of the last body at every set-point, without acceleration limits.
"""

import json
from typing import Any

import mujoco
import numpy as np

from harness import Missing, Peer, calls, measured, row
from peer_programs import BUILT, mink_collision, mink_penetrations
from vergence.arrays import FloatArray
from vergence.control import CameraMounting, Limits, QuadraticProgram
from vergence.control.limits import collision_rows
from vergence.control.solvers import Problem, Setting
from vergence.control.solvers.solver import AT_TIP, NO_FEATURES, NO_JOINTS
from vergence.simulation.clearance import NEAR_M
from vergence.studies.guarantees.collisions import (
    ALONG_S,
    CELLS,
    MARGIN_M,
    RUN_S,
    ObstacleScene,
    draw_scene,
    law_of,
    try_obstacles,
)
from vergence.studies.guarantees.runs import CAMERA_MODEL

FOLDER = BUILT / "collision"
NEAR_PAIRS, PATHS, INNER_S = 10, 40, 1 / 120
LAW = "constrained position-based"


def scene_of(count: int) -> ObstacleScene:
    """Return the first scene of the Puma in which so many pairs are measured at the start."""
    for index in range(0, 4000, len(CELLS)):
        scene = draw_scene(0, index)
        if len(scene.clearance.near(scene.start).pair) == count:
            return scene
    raise LookupError(f"no scene with {count} pairs near")


def setup_of(scene: ObstacleScene) -> dict[str, Any]:
    """Return what mink has to know of a scene."""
    arm = scene.model.arms[scene.model.cell.task.arm]
    name = scene.model.cell.task.arm
    return {
        "q": scene.start.tolist(),
        "joints": [f"{name}/{joint}" for joint in arm.names],
        "rate_max": arm.rate_max.tolist(),
        "frame": f"{name}/{scene.model.cell.arms[name].body}",
        "pairs": scene.clearance.geoms.tolist(),
        "margin_m": MARGIN_M,
        "range_m": NEAR_M,
    }


def save_model(scene: ObstacleScene, name: str) -> str:
    """Write a scene's model where the peer finds it, its shapes made for contacts as mink asks."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    m, path = scene.model.model, FOLDER / f"{name}.mjb"
    masks = m.geom_contype.copy(), m.geom_conaffinity.copy()
    m.geom_contype[:] = m.geom_conaffinity[:] = 1
    mujoco.mj_saveModel(m, str(path))
    m.geom_contype[:], m.geom_conaffinity[:] = masks
    return str(path)


def path_of(scene: ObstacleScene) -> dict[str, Any]:
    """Return a scene with the poses that the last body is to take at every set-point."""
    setup, model = setup_of(scene), scene.model
    setup["model"] = save_model(scene, model.cell.name)
    m, name = model.model, model.cell.task.arm
    setup |= {"geom_pos": m.geom_pos.tolist(), "geom_quat": m.geom_quat.tolist(), "dt": INNER_S}
    positions, quaternions = [], []
    for time in np.arange(0.0, RUN_S, INNER_S):
        share = 0.5 - 0.5 * np.cos(np.pi * min(time / ALONG_S, 1.0))
        model.place_arm(name, scene.start + share * (scene.end - scene.start))
        body = model.data.body(setup["frame"])
        positions.append(body.xpos.tolist())
        quaternions.append(body.xquat.tolist())
    return setup | {"positions": positions, "quaternions": quaternions}


def tick_of(scene: ObstacleScene) -> Any:
    """Return the constrained solver's tick: distances, every limit, joint rates."""
    model = scene.model
    arm = model.arm_to_camera(model.cell.task.camera)
    limits = Limits(manipulability_share=0.0)
    setting = Setting(
        arm, CameraMounting(CAMERA_MODEL), limits, INNER_S, clearance=scene.clearance
    )  # fmt: skip
    solver = QuadraticProgram().bind(setting)
    q, rest = scene.start.copy(), np.zeros(arm.joint_count)
    twist: FloatArray = np.full(6, 0.05)

    def tick() -> object:
        q[0] += 1e-9
        problem = Problem(q, rest, np.eye(6), twist, NO_FEATURES, rest, *NO_JOINTS, AT_TIP)
        return solver.solve(problem)

    return tick


def run() -> list[dict[str, Any]]:
    indices = [i for i in range(len(CELLS) * PATHS) if law_of(i) == LAW][:PATHS]
    paths = [path_of(draw_scene(0, index)) for index in indices]
    (FOLDER / "paths.json").write_text(json.dumps(paths))
    overlaps = sum(try_obstacles(0, index).least_m <= 0.0 for index in indices)
    unit = f"of {len(indices)} paths"
    rows = [measured("paths among obstacles with bodies that overlap", overlaps, unit)]
    theirs = mink_penetrations(FOLDER / "paths.json")
    if not isinstance(theirs, Missing):
        rows.append(measured("the same paths, mink", sum(d <= 0.0 for d in theirs), unit))
    scene = scene_of(NEAR_PAIRS)
    save_model(scene, "model")
    (FOLDER / "pairs.json").write_text(json.dumps(setup_of(scene)))
    clearance, q = scene.clearance, scene.start
    name = f"{NEAR_PAIRS} pairs near of {len(clearance.margin)}"
    peer: Peer | Missing = mink_collision()
    return [
        *rows,
        row(
            f"collision rows: {name}",
            calls(lambda: collision_rows(clearance.near(q), 2.0)),
            value_aim=25.0,
        ),
        row(f"constrained tick: {name}", calls(tick_of(scene)), peer),
    ]
