"""Times mink's collision limit, and counts how often it lets bodies penetrate.

Case: `tick` is one `solve_ik` on the Puma with configuration, velocity and collision limits, the
pairs those of `model.mjb` and `pairs.json`, which `bench_collision.py` writes beside the peers.
`mink_collision.py penetrations FILE` follows the paths of a file that it writes, among obstacles,
and prints how near any pair came on each.
"""

import json
import sys
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mink
import mujoco
import numpy as np
from timed_cases import Case, main

FOLDER = Path(__file__).parents[2] / "build" / "peers" / "collision"
PERIOD = 1 / 30  # s, of a tick


def limits(model: mujoco.MjModel, setup: Mapping[str, Any]) -> list[mink.Limit]:
    """The limits, the collision limit with our margin and range, else as mink has them."""
    rates = dict(zip(setup["joints"], setup["rate_max"], strict=True))
    pairs = [([a], [b]) for a, b in setup["pairs"]]
    return [
        mink.ConfigurationLimit(model),
        mink.VelocityLimit(model, {name: np.array([rate]) for name, rate in rates.items()}),
        mink.CollisionAvoidanceLimit(
            model,
            pairs,
            minimum_distance_from_collisions=setup["margin_m"],
            collision_detection_distance=setup["range_m"],
        ),
    ]


def cases() -> Mapping[str, Case]:
    model = mujoco.MjModel.from_binary_path(str(FOLDER / "model.mjb"))
    setup = json.loads((FOLDER / "pairs.json").read_text())
    q = np.array(setup["q"])
    configuration = mink.Configuration(model, q=q)
    task = mink.FrameTask(setup["frame"], "body", position_cost=1.0, orientation_cost=1.0)
    task.set_target_from_configuration(configuration)
    kept = limits(model, setup)
    q = q + 1e-3

    def tick() -> np.ndarray:
        q[0] += 1e-9
        configuration.update(q)
        return mink.solve_ik(configuration, [task], PERIOD, "daqp", limits=kept)

    return {"tick": tick}


def nearest(file: Path) -> list[float]:
    """The least distance of any pair on each path of a file, m."""
    least = []
    for setup in json.loads(file.read_text()):
        model = mujoco.MjModel.from_binary_path(setup["model"])
        model.geom_pos[:], model.geom_quat[:] = setup["geom_pos"], setup["geom_quat"]
        configuration = mink.Configuration(model, q=np.array(setup["q"]))
        task = mink.FrameTask(setup["frame"], "body", position_cost=1.0, orientation_cost=1.0)
        kept, dt, worst = limits(model, setup), setup["dt"], np.inf
        for position, quaternion in zip(setup["positions"], setup["quaternions"], strict=True):
            task.set_target(mink.SE3(np.concatenate((quaternion, position))))
            try:
                rates = mink.solve_ik(configuration, [task], dt, "daqp", limits=kept)
            except mink.MinkError:  # no solution: it stays where it is
                rates = np.zeros(model.nv)
            configuration.integrate_inplace(rates, dt)
            for a, b in kept[-1].geom_id_pairs:  # those that mink itself leaves out do not count
                distance = mujoco.mj_geomDistance(model, configuration.data, a, b, 0.1, None)
                worst = min(worst, distance)
        least.append(worst)
    return least


if __name__ == "__main__":
    if sys.argv[1:2] == ["penetrations"]:
        print(json.dumps(nearest(Path(sys.argv[2]))))
    else:
        main(f"mink {version('mink')}", cases())
