"""The Puma 560's model against the parameters of Denavit and Hartenberg that it was made from."""

from importlib.resources import files

import mujoco
import numpy as np
import pytest

from vergence.robot import Arm

# a, d, alpha; Corke and Armstrong-Hélouvry (1994)
PARAMETERS = (
    (0.0, 0.0, np.pi / 2),
    (0.4318, 0.0, 0.0),
    (0.0203, 0.15005, -np.pi / 2),
    (0.0, 0.4318, np.pi / 2),
    (0.0, 0.0, -np.pi / 2),
    (0.0, 0.0, 0.0),
)
LIMITS_DEG = ((-160, 160), (-45, 225), (-225, 45), (-110, 170), (-100, 100), (-266, 266))


def link(theta: float, a: float, d: float, alpha: float) -> np.ndarray:
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array(
        [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    )


@pytest.fixture(scope="module")
def puma() -> Arm:
    model = str(files("vergence").joinpath("cells/puma560/puma560.xml"))
    return Arm.from_mujoco(mujoco.MjModel.from_xml_path(model), "flange", kind="body")


def test_its_kinematics_are_denavits_and_hartenbergs(puma: Arm) -> None:
    rng = np.random.default_rng(13)
    for q in rng.uniform(-np.pi, np.pi, (20, 6)):
        T = np.eye(4)
        for angle, (a, d, alpha) in zip(q, PARAMETERS, strict=True):
            T = T @ link(angle, a, d, alpha)
        np.testing.assert_allclose(puma.forward_kinematics(q), T, atol=1e-8)


def test_its_limits_are_the_published_ones(puma: Arm) -> None:
    np.testing.assert_allclose(np.rad2deg([puma.q_min, puma.q_max]).T, LIMITS_DEG, atol=1e-9)


def test_a_straight_elbow_and_an_aligned_wrist_are_singular(puma: Arm) -> None:
    free = np.array([0.3, 0.8, -2.4, 0.4, 0.9, -0.2])
    aligned = free.copy()
    aligned[4] = 0.0
    straight = free.copy()
    straight[2] = np.arctan2(0.0203, 0.4318) - np.pi / 2
    for q, singular in ((free, False), (aligned, True), (straight, True)):
        smallest = np.linalg.svd(puma.jacobian(q), compute_uv=False)[-1]
        assert (smallest < 1e-3) == singular
