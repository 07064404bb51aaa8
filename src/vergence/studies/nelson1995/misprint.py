"""[Nelson1995] eq. (13) as it is printed."""

import numpy as np

from vergence.control import CameraState, OptimalTracking, Quadratic
from vergence.parts import objective

_PAPERS = OptimalTracking(axes=("x", "y"), Q=2e-6, R=10.0)
_MIRRORED = np.array([-1.0, 1.0, 1.0, 1.0, 1.0, 1.0])


@objective
class PrintedTracking:
    """Two-axis tracking with the first entry of B without its minus, as (13) has it and (4) not.

    The column of the camera's x axis has no other entry, so its sign is that of the axis.
    """

    def quadratic(self, state: CameraState) -> Quadratic:
        """Return the quadratic for this tick."""
        right = _PAPERS.quadratic(state)
        return Quadratic(_MIRRORED[:, None] * right.H * _MIRRORED, _MIRRORED * right.g)
