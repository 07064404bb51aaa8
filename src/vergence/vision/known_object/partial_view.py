"""How strongly the edges in an image support a pose of an object of which a part may be hidden.

What hides an object covers one side of it, or a band across it: the edges that are missing lie
together. Beside it all edges must be found, and where the pose predicts them. Places that are found
by chance, in clutter or on what hides the object, lie anywhere within the tolerance instead.
"""

from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.vision.known_object.edge_measurement import EdgeMeasurement
from vergence.vision.known_object.pose_evidence import ALIKE, MOST_OF_EDGE, place_nats

_FOUND = 0.95  # fraction of the places found on visible edges
_PRECISE_PX = 0.5  # standard deviation of their residuals
_COMPLETE = 0.9  # fraction found of an object that nothing hides
_DECISIVE = 0.5  # share of the information about a motion that one edge holds
_MOST_GROWTH = 100.0  # of a variance without one of the edges: ten times the deviation
ONE_EDGE = "a part is hidden, and one edge alone, which may be another object's, decides the pose"
_DIRECTIONS, _BOUNDS = 12, 24  # of the borders that are tried, and their places along each


class PartialView(NamedTuple):
    """The part of an object that is visible, if it has a pose."""

    nats: float  # log likelihood ratio of the pose to chance
    visible: BoolArray  # (N,) which of the places are not hidden
    share: float  # fraction of these that was found


NOT_SEEN = PartialView(0.0, np.zeros(0, dtype=np.bool_), 0.0)


def partial_view(seen: EdgeMeasurement, chance: float) -> PartialView:
    """Return the visible part under which the pose is most likely.

    A hidden place says nothing; for the others see `place_nats`. Neighbouring places are not
    independent, and an edge may coincide with another line, so that an edge counts as three places
    at most.

    Args:
        seen: the measurement at the pose.
        chance: fraction of the places that is found at wrong poses.
    """
    count, found = len(seen.samples_px), seen.samples_found
    if not found.any():
        return PartialView(0.0, np.zeros(count, dtype=np.bool_), 0.0)
    nats = place_nats(seen, chance, _FOUND, _PRECISE_PX)
    _, edge, places = np.unique(seen.samples.edge, return_inverse=True, return_counts=True)
    nats *= (np.minimum(places / ALIKE, MOST_OF_EDGE) / places)[edge]
    visible = _visible(np.asarray(seen.samples_px), nats)
    share = float(np.mean(found[visible])) if visible.any() else 0.0
    return PartialView(float(nats[visible].sum()), visible, share)


def one_edge_decides(seen: object) -> bool:
    """Return whether some of an object is hidden and one edge alone determines a rotation of it.

    It could be an edge of what hides the object.
    """
    if not isinstance(seen, EdgeMeasurement) or seen.share >= _COMPLETE:
        return False
    return growth_without_an_edge(seen) > _MOST_GROWTH


def decisive_edges(seen: object) -> IntArray:
    """Return the edges of a partly hidden object that determine a motion as well as the rest does.

    Each could be an edge of what hides the object.
    """
    if not isinstance(seen, EdgeMeasurement) or seen.share >= _COMPLETE:
        return np.zeros(0, dtype=np.int64)
    edges, shares = _information_shares(seen)
    return edges[shares > _DECISIVE]


def growth_without_an_edge(seen: EdgeMeasurement) -> float:
    """Return the largest factor by which a variance of the pose grows without one of its edges.

    Infinite if the other edges do not determine the pose.
    """
    shares = _information_shares(seen)[1]
    left = 1.0 - float(shares.max()) if len(shares) else 0.0
    return 1.0 / left if left > 0.0 else float("inf")


def _information_shares(seen: EdgeMeasurement) -> tuple[IntArray, FloatArray]:
    """Return the edges that were found, (E,), and each one's largest share in what is known.

    It is the largest share of the information about any motion of the object. Image coordinates
    count as undistorted.
    """
    found = seen.samples_found
    places = seen.samples.points[found] @ seen.fit.T[:3, :3].T + seen.fit.T[:3, 3]
    x, y, z = places.T
    nu, nv = seen.samples.normals[found].T
    shift = np.column_stack((nu, nv, -(nu * x + nv * y) / z)) / z[:, None]
    slopes = np.hstack((shift, np.cross(places, shift)))
    slopes /= np.linalg.norm(slopes, axis=0)
    edges = seen.samples.edge[found]
    inverse = np.linalg.pinv(slopes.T @ slopes, hermitian=True)
    each = np.unique(edges)
    shares = [
        float(np.linalg.eigvals(inverse @ (one.T @ one)).real.max())
        for one in (slopes[edges == edge] for edge in each)
    ]
    return each, np.array(shares)


def _visible(points_px: FloatArray, nats: FloatArray) -> BoolArray:
    """Return the places outside the band, or the half plane, that leaves the highest sum."""
    best, visible = float(nats.sum()), np.ones(len(nats), dtype=np.bool_)
    for k in range(_DIRECTIONS):
        angle = np.pi * k / _DIRECTIONS
        order = np.argsort(points_px @ (np.cos(angle), np.sin(angle)), kind="stable")
        sums = np.append(0.0, np.cumsum(nats[order]))
        bounds = np.linspace(0, len(nats), _BOUNDS + 1).round().astype(np.int64)
        hidden = sums[bounds][None, :] - sums[bounds][:, None]  # from one border to another
        first, last = np.unravel_index(np.argmin(np.triu(hidden)), hidden.shape)
        if sums[-1] - hidden[first, last] > best:
            best = float(sums[-1] - hidden[first, last])
            visible = np.ones(len(nats), dtype=np.bool_)
            visible[order[bounds[first] : bounds[last]]] = False
    return visible
