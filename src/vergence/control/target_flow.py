"""Image motion of features caused by the target's own motion, smoothed and extrapolated."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray


class FlowState(NamedTuple):
    """The flow of each feature and its rate of change."""

    flow: FloatArray  # (M, 2) 1/s
    trend: FloatArray  # (M, 2) 1/s²
    behind_s: float  # from the time of the flow to the newest image


def no_flow(count: int) -> FlowState:
    """Return the state of features whose flow is unknown."""
    return FlowState(np.zeros((count, 2)), np.zeros((count, 2)), 0.0)


@njit(cache=True, error_model="numpy")
def measured_flow(
    state: FlowState, flow: FloatArray, known: BoolArray, elapsed_s: float, smoothing_s: float
) -> FlowState:
    """Return the state after a flow (M, 2), 1/s, was measured, where it is known, (M,).

    Args:
        state: before.
        flow: between the last image and this one.
        known: where it is.
        elapsed_s: between the images.
        smoothing_s: T, see `TargetFlow`.
    """
    kept = np.exp(-elapsed_s / smoothing_s) if smoothing_s > 0.0 else 0.0
    smoothed, trend = state.flow + elapsed_s * state.trend, state.trend.copy()
    for j in range(len(flow)):
        if known[j] and np.isfinite(flow[j, 0]) and np.isfinite(flow[j, 1]):
            for a in range(2):
                deviation = flow[j, a] - smoothed[j, a]
                smoothed[j, a] += (1.0 - kept**2) * deviation
                trend[j, a] += (1.0 - kept) ** 2 / elapsed_s * deviation
    return FlowState(smoothed, trend, 0.5 * elapsed_s)


@njit(cache=True, error_model="numpy")
def flow_at(state: FlowState, ahead_s: float) -> FloatArray:
    """Return the flow (M, 2), 1/s, at a time after the newest image."""
    return state.flow + (state.behind_s + ahead_s) * state.trend


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
        self.start(0)

    def start(self, count: int) -> None:
        """Start with a given number of features of unknown flow."""
        self.state = no_flow(count)

    def measure(self, flow: FloatArray, known: BoolArray, elapsed_s: float) -> None:
        """Process the flow (M, 2), 1/s, between the last image and this one, where it is known."""
        self.state = measured_flow(self.state, flow, known, elapsed_s, self._smoothing_s)

    def at(self, ahead_s: float) -> FloatArray:
        """Return the flow (M, 2), 1/s, at a time after the newest image."""
        flow: FloatArray = flow_at(self.state, ahead_s)
        return flow
