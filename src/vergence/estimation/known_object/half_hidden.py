"""The pose of a lost object that is partly hidden, if the image and the prediction decide it."""

from collections.abc import Sequence

import numpy as np

from vergence.estimation.known_object.object_follower import pose_distance
from vergence.estimation.known_object.object_rivals import DECIDED, Compare, is_near
from vergence.estimation.known_object.object_search import Fit, Near
from vergence.vision.known_object.edge_measurement import EdgeMeasurement
from vergence.vision.known_object.partial_view import (
    NOT_SEEN,
    ONE_EDGE,
    one_edge_decides,
    partial_view,
)

# Log likelihood ratios. A search reaches about 10⁵ poses that differ, and chance may win one in a
# thousand times. Of a hidden object four edges never suffice: many things are rectangles.
_SURE = float(np.log(1e5) + np.log(1e3))
_SURE_HALF = _SURE + float(np.log(1e2))
_PREDICTED = 22.5  # χ² with six degrees of freedom: 999 of 1000


def enough_seen(
    fits: Sequence[Fit], near: Near | None, least_share: float, compare: Compare, chance: float
) -> list[Fit] | str:
    """Return the poses that explain what is seen of a lost object, or why there is none.

    What is seen must be too much for chance. Of an object that is partly hidden, the part that is
    visible beside what hides it must be found as completely as a whole object, it must not fit at
    another place or turned, and the pose must agree with the prediction.

    Args:
        fits: poses fitted to the edges of an image, at least one.
        near: where the object is predicted; without it, one that is partly hidden is not found.
        least_share: fraction of the visible part that must be found.
        compare: two of them.
        chance: fraction of the places that is found at wrong poses.

    Returns:
        The likeliest pose and those as likely; or why there is none, empty if too little is seen.
    """
    views = [
        partial_view(fit.seen, chance) if isinstance(fit.seen, EdgeMeasurement) else NOT_SEEN
        for fit in fits
    ]
    nats = np.array([view.nats for view in views])
    best = int(np.argmax(nats))
    T = fits[best].T_camera_target
    whole = fits[best].share >= least_share
    if nats[best] < (_SURE if whole else _SURE_HALF) or views[best].share < least_share:
        return ""
    if one_edge_decides(fits[best].seen):
        return ONE_EDGE
    order = np.argsort(-nats, kind="stable")
    alike = [
        fits[k] for k in order if k == best or compare(fits[best].seen, fits[k].seen) < DECIDED
    ]
    if whole:
        return [fit for fit in alike if fit.share >= least_share]
    if near is None:
        return ""
    if not all(is_near(fit.T_camera_target, T) for fit in alike):
        return "several poses explain what is seen of the object"
    if pose_distance(T, near.T_camera_target, near.covariance) > _PREDICTED:
        return "what is seen of the object is not where it was predicted"
    return [fits[best]]
