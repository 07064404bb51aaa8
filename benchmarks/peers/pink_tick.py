"""Times pink: one `solve_ik` on the Puma with configuration and velocity limits.

Case: `tick` moves the configuration a little, solves for a pose of the flange, and returns the
joint rates, as a servo does each time.
"""

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pink
import pinocchio
from timed_cases import Case, main

MODEL = Path(__file__).parents[2] / "src" / "vergence" / "cells" / "puma560" / "puma560.xml"
START = np.array([-2.19, 0.75, -3.01, 0.1, -0.87, 0.2])
RATE_MAX, PERIOD = 2.0, 1 / 30  # rad/s, s


def cases() -> Mapping[str, Case]:
    model = pinocchio.buildModelFromMJCF(str(MODEL))
    model.velocityLimit = np.full(model.nv, RATE_MAX)
    data = model.createData()
    configuration = pink.Configuration(model, data, START)
    task = pink.FrameTask("flange", position_cost=1.0, orientation_cost=1.0)
    task.set_target_from_configuration(configuration)
    limits = [pink.limits.ConfigurationLimit(model), pink.limits.VelocityLimit(model)]
    q = START + 0.05

    def tick() -> np.ndarray:
        q[0] += 1e-9
        configuration.update(q)
        return pink.solve_ik(configuration, [task], PERIOD, "daqp", limits=limits)

    return {"tick": tick}


if __name__ == "__main__":
    main(f"pink {version('pin-pink')}", cases())
