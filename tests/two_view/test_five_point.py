"""Motions of five matches: every true one is found, and each answer is an essential matrix."""

import cv2
import numpy as np
import pytest

from vergence.arrays import FloatArray
from vergence.geometry import skew, so3_exp
from vergence.vision.two_view.five_point import five_point_matrices
from vergence.vision.two_view.polynomial import real_roots

ALL = np.arange(5)[None]


def views(
    random: np.random.Generator, noise: float = 0.0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return five points in two views and the essential matrix of the motion between."""
    points = random.uniform(-1.0, 1.0, (5, 3)) + [0.0, 0.0, 3.0]
    R, t = so3_exp(0.5 * random.normal(size=3)), 0.5 * random.normal(size=3)
    moved = points @ R.T + t
    m_star, m = points[:, :2] / points[:, 2:], moved[:, :2] / moved[:, 2:]
    E = skew(t) @ R
    return m_star, m + noise * random.normal(size=m.shape), E / np.linalg.norm(E)


def test_the_true_motion_is_among_those_found() -> None:
    random = np.random.default_rng(3)
    off = []
    for _ in range(300):
        m_star, m, E = views(random)
        found = five_point_matrices(ALL, m_star, m)
        off.append(min(min(abs(F - E).max(), abs(F + E).max()) for F in found))
    assert np.quantile(off, 0.95) < 1e-8
    assert np.mean(np.array(off) > 1e-4) <= 0.01  # two roots that nearly meet


def test_each_answer_is_an_essential_matrix_that_five_matches_agree_on() -> None:
    random = np.random.default_rng(4)
    unlike = count = 0
    for _ in range(300):
        m_star, m, _ = views(random, noise=1e-3)
        for E in five_point_matrices(ALL, m_star, m):
            cubic = 2.0 * E @ E.T @ E - np.trace(E @ E.T) * E
            a, b = np.column_stack((m_star, np.ones(5))), np.column_stack((m, np.ones(5)))
            epipolar = np.einsum("ni,ij,nj->n", b, E, a)
            unlike += max(abs(cubic).max(), abs(epipolar).max()) > 1e-6
            count += 1
    assert count > 1000
    assert unlike <= 0.005 * count


def test_as_many_motions_are_found_as_opencv_finds() -> None:
    random = np.random.default_rng(5)
    counts = []
    for _ in range(300):
        m_star, m, _ = views(random, noise=1e-3)
        twin, _ = cv2.findEssentialMat(m_star, m, np.eye(3))
        counts.append(
            (len(five_point_matrices(ALL, m_star, m)), 0 if twin is None else len(twin) // 3)
        )
    ours, theirs = np.array(counts).T
    assert np.mean(ours == theirs) > 0.99


def test_five_equal_matches_give_no_motion_and_no_error() -> None:
    same = np.tile([[0.1, 0.2]], (5, 1))
    assert np.isfinite(five_point_matrices(ALL, same, same)).all()


@pytest.mark.parametrize("roots", [(0.5,), (-2.0, 0.001, 3.5), (1e-6, 0.3, 0.30001, 40.0, 1e6), ()])
def test_real_roots_are_found_near_and_far(roots: tuple[float, ...]) -> None:
    p = np.poly([*roots, 0.3 + 0.1j, 0.3 - 0.1j]).real[::-1].copy()
    np.testing.assert_allclose(sorted(real_roots(p)), sorted(roots), rtol=1e-6)
