"""The images that determine the scale: those taken from new camera poses."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.estimation.goal_fit import points_in
from vergence.geometry import pose_difference
from vergence.planning.approach.goal import GoalImage
from vergence.planning.approach.recognition import Recognition, tracked_image
from vergence.vision.tracks import Tracks

_PARALLAX = 0.03  # relative to the object's distance, or rad: camera motion between two kept images
_MOST_IMAGES = 20


def with_tracks(known: Recognition, goal: GoalImage, T: FloatArray, tracks: Tracks) -> Recognition:
    """Return the recognition with the points of another image, if its camera pose is new.

    Args:
        known: the recognition before it.
        goal: the photograph.
        T: T_world_camera of the image, (4, 4).
        tracks: the points tracked into it.
    """
    distance = float(np.median(points_in(T, known.fit.points_world)[:, 2]))
    moves = (pose_difference(T, image.T_world_camera) for image in known.images)
    near = any(
        np.linalg.norm(d[:3]) < _PARALLAX * distance and np.linalg.norm(d[3:]) < _PARALLAX
        for d in moves
    )
    if near or len(known.images) >= _MOST_IMAGES or len(known.star_px) != len(tracks.found):
        return known
    return known.with_image(
        tracked_image(goal, T, tracks.points_px, tracks.covariance_px, tracks.found)
    )
