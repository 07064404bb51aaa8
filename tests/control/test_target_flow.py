"""The target's flow is followed by an α-β filter, as [Nelson1995] section 2.1 suggests."""

import numpy as np
import pytest

from vergence.control.target_flow import TargetFlow

T, STEP = 0.2, 0.1  # s
THETA = float(np.exp(-STEP / T))
SEEN = np.array([True])


def test_a_first_deviation_enters_flow_and_trend_by_alpha_and_beta() -> None:
    flow = TargetFlow(T)
    flow.start(1)
    flow.measure(np.array([[1.0, -2.0]]), SEEN, STEP)
    alpha, beta = 1.0 - THETA**2, (1.0 - THETA) ** 2
    then = flow.at(-0.5 * STEP)  # the flow is that of the middle between the images
    np.testing.assert_allclose(then, [[alpha, -2.0 * alpha]], rtol=1e-12)
    np.testing.assert_allclose(flow.at(0.5) - flow.at(0.0), 0.5 * beta / STEP * np.array([[1, -2]]))


def test_a_flow_that_grows_steadily_is_followed_without_lag() -> None:
    flow = TargetFlow(T)
    flow.start(1)
    for k in range(60):
        flow.measure(np.array([[0.3 * k * STEP, 0.0]]), SEEN, STEP)
    assert flow.at(-0.5 * STEP)[0, 0] == pytest.approx(0.3 * 59 * STEP, rel=1e-6)
