"""One run along a line, as the first paper's figures show it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray
from vergence.signals import Outcome
from vergence.studies.trace import Trace


@dataclass(frozen=True, slots=True)
class Trial:
    """One run: how it ended and its rows."""

    outcome: Outcome
    summary: Mapping[str, float]
    trace: Trace

    @property
    def camera_m(self) -> FloatArray:
        """Camera translation along the motion, (K,)."""
        return _travel(self.trace["T_world_camera"])

    @property
    def object_m(self) -> FloatArray:
        """Object translation along the motion, (K,)."""
        return _travel(self.trace["T_world_target"])

    @property
    def estimated_m(self) -> FloatArray:
        """Object translation as the arm knows it: x + z tan θ, (K,).

        [Nelson1995] eq. (32) prints z / cos θ, which is metres off at large tilt.
        """
        T = self.trace["T_world_camera"]
        height = T[:, 2, 3] - self.trace["T_world_target"][:, 2, 3]
        tilt = np.arctan2(T[:, 0, 2], -T[:, 2, 2])
        return self.camera_m + height * np.tan(tilt)


def _travel(T: FloatArray) -> FloatArray:
    along_x: FloatArray = T[:, 0, 3] - T[0, 0, 3]
    return along_x


Trials = Mapping[tuple[str, int], Trial]  # by strategy and direction, 1 or -1
