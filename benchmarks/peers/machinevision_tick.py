"""Times machinevision-toolbox's IBVS.

Cases: `tick` is what a controller needs of it (image Jacobian and pseudoinverse law, four points),
`step` is its whole simulation step (projection, law, camera motion, history).
"""

from collections.abc import Mapping
from importlib.metadata import version

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
from machinevisiontoolbox import IBVS, CentralCamera, mkgrid
from spatialmath import SE3
from timed_cases import Case, main


def servo() -> IBVS:
    camera = CentralCamera.Default(pose=SE3.Trans(0.2, 0.1, -1.5) * SE3.Rz(0.2))
    desired = 200 * np.array([[-1, -1, 1, 1], [-1, 1, 1, -1]]) + np.c_[camera.pp]
    # eterm=0 and a tiny gain keep the simulated camera where it is, so that every step is alike.
    ibvs = IBVS(
        camera,
        P=mkgrid(2, side=0.5, pose=SE3.Tz(3)),
        p_d=desired,
        depth=4.0,
        lmbda=1e-9,
        eterm=0.0,
        graphics=False,
    )
    ibvs.init()
    return ibvs


def cases() -> Mapping[str, Case]:
    ibvs = servo()
    camera = ibvs.camera
    seen = camera.project_point(ibvs.P)

    def tick() -> np.ndarray:
        jacobian = camera.visjac_p(seen, 4.0)
        error = (seen - ibvs.p_star).flatten(order="F")
        return -0.08 * np.linalg.pinv(jacobian) @ error

    def step() -> int:
        ibvs.history.clear()
        return ibvs.step(0.0)

    return {"tick": tick, "step": step}


if __name__ == "__main__":
    main(f"machinevision-toolbox {version('machinevision-toolbox-python')}", cases())
