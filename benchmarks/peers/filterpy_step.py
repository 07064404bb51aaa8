"""Times filterpy's Kalman filter: 12 states, 16 measurements, matrices given.

Case: `step` is one prediction and one update, filled with the numbers of a real filter.
"""

from collections.abc import Mapping

import filterpy
import numpy as np
from filterpy.kalman import KalmanFilter
from timed_cases import Case, main


def cases() -> Mapping[str, Case]:
    rng = np.random.default_rng(0)
    filter_ = KalmanFilter(dim_x=12, dim_z=16)
    filter_.F[:6, 6:] = np.eye(6) / 26.0
    filter_.Q = np.diag([1e-9] * 6 + [1e-5] * 6)
    filter_.H[:, :6] = rng.standard_normal((16, 6))
    filter_.R *= 1e-6
    filter_.P = np.diag([1e-4] * 6 + [1e-2] * 6)
    z = 1e-3 * rng.standard_normal((16, 1))

    def step() -> None:
        filter_.predict()
        filter_.update(z)

    return {"step": step}


if __name__ == "__main__":
    main(f"filterpy {filterpy.__version__}", cases())
