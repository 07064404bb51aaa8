"""Directions that an arm's joints do not span are named, no others."""

import numpy as np

from vergence.robot import unserved_directions


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
