"""Goal postures by whole turns of several joints at once, and starts that only they lead from."""

from itertools import product

import numpy as np
import pytest

from vergence.planning import OptimisedPlanner, Path
from vergence.robot import Arm, goal_configurations
from vergence.studies.defaults.study import STARTS_SEED, camera_arm, draw


@pytest.fixture(scope="module")
def ur5() -> Arm:
    return camera_arm("ur5")


def test_no_posture_by_whole_turns_is_nearer_than_those_returned(ur5: Arm) -> None:
    random = np.random.default_rng(4)
    for _ in range(3):
        near, there = random.uniform(ur5.q_min, ur5.q_max, (2, 6))
        goals = goal_configurations(ur5, ur5.forward_kinematics(there), near, 8)
        times = np.abs((goals - near) / ur5.rate_max).max(axis=1)
        assert (np.diff(times) >= 0.0).all()
        assert len(goals) == 8
        for goal, turns in product(goals, product((-1, 0, 1), repeat=6)):
            turned = goal + 2 * np.pi * np.array(turns)
            inside = (turned >= ur5.q_min).all() and (turned <= ur5.q_max).all()
            if inside and np.abs((turned - near) / ur5.rate_max).max() < times[-1] - 1e-6:
                assert np.abs(goals - turned).max(axis=1).min() < 1e-3


@pytest.mark.parametrize("index", [135, 283])
def test_starts_that_need_another_posture_have_a_path(ur5: Arm, index: int) -> None:
    path = OptimisedPlanner().plan(draw(ur5, STARTS_SEED, index).problem())
    assert isinstance(path, Path)
    assert path.in_view().all()
    assert path.in_front().all()
