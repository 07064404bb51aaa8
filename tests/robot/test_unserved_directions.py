"""Directions that an arm's joints do not span are named, no others."""

import numpy as np

from vergence.features import interaction_matrix_points
from vergence.robot import unmeasured_directions, unserved_directions


def test_directions_without_a_joint_are_impossible_and_shared_ones_are_tied() -> None:
    J = np.zeros((6, 4))  # moves along x with a turn about y; along y; along z; about z
    J[[0, 4], 0] = 0.3, 1.0
    J[1, 1] = J[2, 2] = J[5, 3] = 1.0
    unserved = unserved_directions(J, 0.3)
    assert unserved.impossible == ("turn about x",)
    assert unserved.tied == ("move along x", "turn about y")
    assert str(unserved) == (
        "cannot turn about x and can move along x and turn about y only in combination"
    )


def test_six_independent_joints_serve_every_direction() -> None:
    J = np.random.default_rng(1).normal(size=(6, 7))
    assert not unserved_directions(J, 0.5)


def test_what_a_quadratic_does_not_measure_is_free() -> None:
    ahead = np.zeros((1, 2))
    L = interaction_matrix_points(ahead, np.full(1, 0.5))
    free = unmeasured_directions(L.T @ L, 0.5)
    assert free.impossible == ("move along z", "turn about z")
    assert free.tied == ("move along x", "move along y", "turn about x", "turn about y")
    square = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
    L = interaction_matrix_points(square, np.full(4, 0.5))
    assert not unmeasured_directions(L.T @ L + 1e-300 * np.eye(6), 0.5)
