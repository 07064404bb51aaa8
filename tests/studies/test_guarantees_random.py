"""Random starts and goals: drawn as said, judged strictly, and brought home by a plan."""

import numpy as np
import pytest

from vergence.studies.guarantees.laws import LAWS, PLANNED, plan_from_homography, servo
from vergence.studies.guarantees.random_runs import Pair, draw_pair, endings, success_check
from vergence.studies.guarantees.runs import arms
from vergence.studies.ideal_loop import Ending


@pytest.fixture(scope="module")
def gantry():
    return arms()[2]


@pytest.mark.parametrize("index", [0, 1, 231])  # the last along the border of the image
def test_planned_and_constrained_brings_the_points_home(gantry, index):
    assert servo(draw_pair(gantry, 5, index), PLANNED, "") is Ending.ARRIVED


def test_a_pair_is_the_same_wherever_it_is_drawn(gantry):
    first, again = (draw_pair(gantry, 5, 3) for _ in range(2))
    np.testing.assert_array_equal(first.q_start, again.q_start)
    np.testing.assert_array_equal(first.T_world_goal, again.T_world_goal)


def test_a_plain_law_is_stopped_where_the_strict_view_or_a_limit_is_passed(gantry):
    scenes = [draw_pair(gantry, 5, index) for index in range(8)]
    ends = {servo(scene, "image-based, desired L", "plain") for scene in scenes}
    assert Ending.ARRIVED in ends
    assert ends & {Ending.VIEW, Ending.JOINT}


def test_the_homography_tells_the_displacement(gantry):
    scene = draw_pair(gantry, 5, 0)
    path = plan_from_homography(scene)
    assert path is not None
    np.testing.assert_allclose(path.problem.T_world_goal, scene.T_world_goal, atol=1e-5)


def test_the_check_fails_with_one_feasible_pair_missed():
    home = Pair((Ending.ARRIVED,) * len(LAWS), False)
    lost = Pair((*(Ending.ARRIVED,) * (len(LAWS) - 1), Ending.VIEW), False)
    hopeless = Pair((Ending.JOINT,) * len(LAWS), True)
    assert success_check([home, hopeless]).holds
    check = success_check([home, lost, hopeless])
    assert not check.holds
    assert check.measured == pytest.approx(0.5)
    assert endings([home, lost, hopeless], LAWS[-1]) == {Ending.ARRIVED: 1, Ending.VIEW: 1}
