"""Times mink: one `solve_ik` on the Puma with configuration and velocity limits.

Case: `tick` moves the configuration a little, solves for a pose of the flange, and returns the
joint rates, as a servo does each time.
"""

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import mink
import mujoco
import numpy as np
from timed_cases import Case, main

MODEL = Path(__file__).parents[2] / "src" / "vergence" / "cells" / "puma560" / "puma560.xml"
START = np.array([-2.19, 0.75, -3.01, 0.1, -0.87, 0.2])
RATE_MAX, PERIOD = 2.0, 1 / 30  # rad/s, s


def cases() -> Mapping[str, Case]:
    model = mujoco.MjModel.from_xml_path(str(MODEL))
    joints = [model.joint(i).name for i in range(model.njnt)]
    configuration = mink.Configuration(model, q=START)
    task = mink.FrameTask("flange", "body", position_cost=1.0, orientation_cost=1.0)
    task.set_target_from_configuration(configuration)
    limits = [
        mink.ConfigurationLimit(model),
        mink.VelocityLimit(model, dict.fromkeys(joints, np.array([RATE_MAX]))),
    ]
    q = START + 0.05

    def tick() -> np.ndarray:
        q[0] += 1e-9
        configuration.update(q)
        return mink.solve_ik(configuration, [task], PERIOD, "daqp", limits=limits)

    return {"tick": tick}


if __name__ == "__main__":
    main(f"mink {version('mink')}", cases())
