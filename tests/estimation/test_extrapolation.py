import numpy as np
from estimation_scene import moving, pose_error, view

from vergence.estimation import PoseFilter, extrapolate


def test_a_state_looked_ahead_is_that_of_the_filter():
    filter_ = PoseFilter()
    belief = filter_.start(1.0, moving(0.2), np.array([0.1, -0.2, 0.3, 0.5, -0.4, 0.2]))
    ahead = extrapolate(belief.state(), 1.2)
    expected = filter_.predict(belief, 1.2).state()
    np.testing.assert_array_equal(ahead.T_world_target, expected.T_world_target)
    np.testing.assert_array_equal(ahead.covariance, expected.covariance)
    assert ahead.time == 1.2


def test_looking_ahead_over_the_latency_beats_taking_the_old_pose():
    rng = np.random.default_rng(1)
    filter_ = PoseFilter()
    belief = filter_.start(0.0, moving(0.0, 2.0))
    old, ahead = [], []
    for k in range(1, 80):
        time = k / 26
        belief = filter_.update(belief, view(rng, time, moving(time, 2.0))).belief
        now = moving(time + 0.08, 2.0)
        old.append(pose_error(belief.T_world_target, now)[:3])
        later = extrapolate(belief.state(), time + 0.08)
        ahead.append(pose_error(later.T_world_target, now)[:3])
    old, ahead = np.linalg.norm(old[20:], axis=1), np.linalg.norm(ahead[20:], axis=1)
    assert ahead.mean() < 0.4 * old.mean()
