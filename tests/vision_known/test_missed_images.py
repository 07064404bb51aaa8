"""After images without it, the pose of a real object is right within what is stated, or none is."""

import numpy as np

from real_images import IMAGES, PACKAGE, PERIOD_S, RENDERED_CASTLE, blurred
from vergence.estimation.known_object.hypothesis_follower import HypothesisFollower
from vergence.estimation.known_object.object_follower import Sighting
from vergence.geometry import pose_difference
from vergence.vision.known_object import EdgeTracker

STEP, SEEN, GONE, LAST = 2, 5, 4, 14
SIGMA_PX = 2.0
WRONG = 5.0  # deviations


def test_a_castle_whose_tower_is_square_is_not_turned_by_a_quarter() -> None:
    assert IMAGES.is_dir(), f"{PACKAGE} is missing"
    known, blur = RENDERED_CASTLE, blurred(SIGMA_PX)
    images, poses = known.images()[::STEP], known.true_poses()
    assert poses is not None
    follower = HypothesisFollower(
        EdgeTracker(known.model), known.camera, [known.first_pose()], 0.0, PERIOD_S
    )
    stated = []
    for k in range(LAST):
        grey = np.full_like(images[k], 128)
        image = grey if SEEN <= k < SEEN + GONE else blur(images[k], k)
        step = follower.follow(image, PERIOD_S * k)
        if step.sighting is Sighting.SEEN:
            error = pose_difference(step.T_camera_target, poses[STEP * k])
            assert error @ np.linalg.solve(step.covariance[:6, :6], error) < WRONG**2, k
            stated.append(k)
        else:
            assert step.reason
    assert stated[:SEEN] == list(range(SEEN))
