"""From a camera twist to joint rates: slowed as a whole, never turned aside."""

import numpy as np
import pytest

from vergence.control._rates import resolve_twist


def test_without_limits_the_arm_moves_its_camera_as_desired() -> None:
    rng = np.random.default_rng(24)
    J, v_camera = rng.normal(size=(6, 7)), rng.normal(size=6)
    rates, scale = resolve_twist(np.linalg.pinv(J), v_camera, np.full(7, np.inf))
    assert scale == 1.0
    np.testing.assert_allclose(J @ rates, v_camera)


@pytest.mark.parametrize("joint_count", [6, 7])
def test_the_camera_keeps_its_course_and_no_joint_passes_its_rate(joint_count: int) -> None:
    rng = np.random.default_rng(25)
    for _ in range(100):
        J, v_camera = rng.normal(size=(6, joint_count)), 10 ** rng.uniform(-3, 3) * np.ones(6)
        rate_max = rng.uniform(0.1, 3.0, joint_count)
        rates, scale = resolve_twist(np.linalg.pinv(J), v_camera, rate_max)
        assert 0.0 < scale <= 1.0
        assert (abs(rates) <= rate_max * (1 + 1e-12)).all()
        np.testing.assert_allclose(J @ rates, scale * v_camera, rtol=1e-9, atol=1e-9)
        if scale < 1.0:
            assert np.max(abs(rates) / rate_max) == pytest.approx(1.0)


def test_a_camera_at_rest_needs_no_rates() -> None:
    rates, scale = resolve_twist(np.eye(6), np.zeros(6), np.ones(6))
    assert scale == 1.0
    np.testing.assert_array_equal(rates, 0.0)
