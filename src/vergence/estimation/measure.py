"""What perception asks of others: the poses of its cameras, and points inside windows."""

from collections.abc import Callable, Mapping
from typing import Protocol, TypeAlias

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.camera import Frame
from vergence.estimation.visibility import Sight, SightArray
from vergence.features import ImagePoints

Joints: TypeAlias = Mapping[str, FloatArray]  # arm name to joint positions, rad or m
# camera_pose(camera, joints at the exposure) -> T_world_camera (4, 4)
CameraPose: TypeAlias = Callable[[str, Joints], FloatArray]
# find(frame) -> all features of the target wherever they are in the picture, or None
Find: TypeAlias = Callable[[Frame], ImagePoints | None]

UNSEEN = {
    Sight.VISIBLE: "not chosen",
    Sight.BEHIND: "behind the camera",
    Sight.OUTSIDE: "outside the picture",
    Sight.TURNED_AWAY: "turned away",
    Sight.HIDDEN: "hidden by the target itself",
    Sight.BLOCKED: "something in the way",
}


class Measure(Protocol):
    """Finds features of the target inside windows of one picture."""

    def __call__(
        self,
        frame: Frame,
        features: IntArray,
        points_px: FloatArray,
        half_px: FloatArray,
        T_camera_target: FloatArray,
    ) -> ImagePoints:
        """Return the K points asked for, in that order.

        Args:
            frame: the picture.
            features: which features of the target, (K,).
            points_px: where they are expected: the windows' centres, (K, 2).
            half_px: half the width and height of the windows, (K, 2).
            T_camera_target: the expected pose, (4, 4): how edges and marks will lie.
        """
        ...


def spread_out(
    found: ImagePoints,
    features: IntArray,
    kept: IntArray,
    expected_px: FloatArray,
    sight: SightArray,
    widest_px: float,
) -> ImagePoints:
    """Return image points of all M features from those K that were measured.

    A feature that was not found stands at its expected place, with a covariance as wide as the
    widest window and the reason.

    Args:
        found: what was measured, K points.
        features: their numbers, (K,).
        kept: numbers of the features that agree with the pose.
        expected_px: predicted places, (M, 2).
        sight: a `Sight` each, (M,).
        widest_px: half the widest window.
    """
    places = expected_px.copy()
    covariance = np.tile(np.eye(2) * widest_px**2, (len(places), 1, 1))
    reasons = [UNSEEN[Sight(value)] for value in sight]
    mask = np.zeros(len(places), dtype=np.bool_)
    mask[kept] = True
    for k, m in enumerate(features):
        reasons[m] = found.reasons[k] or ("" if mask[m] else "disagrees with the pose")
    places[kept] = found.points_px[np.isin(features, kept)]
    covariance[kept] = found.covariance_px[np.isin(features, kept)]
    return ImagePoints(found.camera, found.time, places, covariance, mask, tuple(reasons))
