"""The gantry, its camera and the nine marks, as the planners see them."""

from functools import cache
from pathlib import Path

import mujoco
import numpy as np

import vergence
from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.robot import Arm

CELL = Path(vergence.__file__).parent / "cells" / "gantry"
CAMERA = Camera(640, 480, 720.0, 720.0, 319.5, 239.5)


@cache
def gantry() -> Arm:
    """Return the gantry up to a camera that looks along the flange's x axis, 0.2 m ahead."""
    spec = mujoco.MjSpec.from_file(str(CELL / "gantry.xml"))
    # MuJoCo's camera looks along its -z with y up: x = flange y, y = -flange z, z = -flange x.
    spec.body("flange").add_camera(name="eye", pos=[0.2, 0, 0], xyaxes=[0, 1, 0, 0, 0, -1])
    rates = np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])
    return Arm.from_mujoco(spec.compile(), "eye", rates, 4 * rates)


@cache
def marks() -> FloatArray:
    """Return the marks' centres in the target's frame, (9, 3), m."""
    model = mujoco.MjSpec.from_file(str(CELL / "marks.xml")).compile()
    return frozen([model.site(f"mark{j + 1}").pos for j in range(9)])
