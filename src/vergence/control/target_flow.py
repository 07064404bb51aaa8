"""Image motion of features caused by the target's own motion, smoothed and extrapolated."""

import numpy as np

from vergence.arrays import BoolArray, FloatArray


class TargetFlow:
    """Estimates the flow of each feature and its rate of change.

    Flow f and trend g are smoothed by exponential weights of one time constant T, without lag
    behind a steady change: with θ = exp(-Δt/T) and the deviation ε of a measured flow from the
    predicted one, f ← f + Δt g + (1 - θ²) ε and g ← g + (1 - θ)² ε / Δt. This is an α-β filter with
    α = 1 - θ² and β = (1 - θ)², which [Nelson1995] section 2.1 mentions for its d_F. A flow
    measured between two images belongs to the time midway between them.

    Args:
        smoothing_s: T; infinite for a flow that is always zero.
    """

    def __init__(self, smoothing_s: float) -> None:
        self._smoothing_s = smoothing_s
        self.clear()

    def clear(self) -> None:
        """Clear the estimates: the features have changed."""
        self._flow = self._trend = np.zeros((0, 2))
        self._behind_s = 0.0  # from the time of the flow to the newest image

    def start(self, count: int) -> None:
        """Start with a given number of features of unknown flow."""
        self._flow = self._trend = np.zeros((count, 2))

    def measure(self, flow: FloatArray, known: BoolArray, elapsed_s: float) -> None:
        """Process the flow (M, 2), 1/s, between the last image and this one, where it is known."""
        kept = np.exp(-elapsed_s / self._smoothing_s) if self._smoothing_s > 0.0 else 0.0
        predicted = self._flow + elapsed_s * self._trend
        known = known & np.isfinite(flow).all(axis=1)
        deviation = np.where(known[:, None], flow - predicted, 0.0)
        self._flow = predicted + (1.0 - kept**2) * deviation
        self._trend = self._trend + (1.0 - kept) ** 2 / elapsed_s * deviation
        self._behind_s = 0.5 * elapsed_s

    def at(self, ahead_s: float) -> FloatArray:
        """Return the flow (M, 2), 1/s, at a time after the newest image."""
        flow: FloatArray = self._flow + (self._behind_s + ahead_s) * self._trend
        return flow

    def moved(self, ahead_s: float) -> FloatArray:
        """Return the features' displacement (M, 2) by target motion since the newest image."""
        moved: FloatArray = ahead_s * self.at(0.5 * ahead_s)
        return moved
