"""An objective of one's own: `kind = "mine:Centre"` in a cell beside this file."""

import numpy as np

from vergence.control import CameraState, Quadratic, least_squares
from vergence.parts import knob, part


@part("objective")
class Centre:
    """Keeps the middle of the features in the middle of the image, whatever else happens."""

    gain: float = knob(1.0, "1/s", above=0, upto=20)  # how fast the error decays

    def quadratic(self, state: CameraState) -> Quadratic:
        """Return the quadratic for this tick."""
        L = state.features.interaction().reshape(-1, 2, 6)
        middle, drift = state.points.mean(axis=0), state.flow.mean(axis=0)
        return least_squares(np.mean(L, axis=0), -self.gain * middle - drift, damping=1e-3)
