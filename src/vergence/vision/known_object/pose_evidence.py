"""How much more the edges in an image support one pose of an object than another.

What both poses predict at one place says nothing about which of them is right: only edges that one
of them predicts and the other does not are compared.
"""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.camera import Camera
from vergence.geometry import transform_points
from vergence.vision.known_object.edge_measurement import EdgeMeasurement
from vergence.vision.known_object.edge_samples import EdgeSamples

TOLERANCE_PX = 1.5  # within which an edge of a sharp image is found, also by chance
ALIKE = 4.0  # places that count as one
MOST_OF_EDGE = 3.0  # independent places that an edge counts as, at most: it may lie on a line
_FOUND = 0.9  # fraction of the places found on edges that show
PRECISE_PX = 0.7  # standard deviation of their residuals in a sharp image
_SHOWS = 0.9  # fraction of the edges that have contrast and are not hidden
_LEAST_CHANCE, _MOST_CHANCE = 0.3, 0.9
_ALONG_PX, _PARALLEL = 10.0, 0.9  # of two edges at one place


def place_nats(seen: EdgeMeasurement, chance: float, found: float, precise_px: float) -> FloatArray:
    """Return the log likelihood ratio of an edge to chance at each place, (N,).

    log(s N(r; 0, σ) / (c U(r))) with a residual r if the edge was found, which chance spreads
    evenly over the tolerance, and log((1 - s) / (1 - c)) if it was not. Both lengths grow with the
    blur of the edges.

    Args:
        seen: the measurement at a pose.
        chance: c, fraction of the places that is found at wrong poses.
        found: s, fraction that is found on visible edges.
        precise_px: σ, standard deviation of their residuals in a sharp image.
    """
    chance = float(np.clip(chance, _LEAST_CHANCE, _MOST_CHANCE))
    residuals = np.where(seen.samples_found, seen.fit.residuals, 0.0) / seen.blur
    precise = np.exp(-0.5 * (residuals / precise_px) ** 2) / (precise_px * np.sqrt(2.0 * np.pi))
    of_found = np.log(found * precise / (chance / (2.0 * TOLERANCE_PX)))
    nats: FloatArray = np.where(
        seen.samples_found, of_found, np.log((1.0 - found) / (1.0 - chance))
    )
    return nats


def edge_nats(seen: EdgeMeasurement, other: EdgeSamples, camera: Camera, chance: float) -> float:
    """Return the log likelihood ratio to chance of the edges that another pose does not predict.

    Neighbouring places are not independent, and an edge may coincide with another line, so that an
    edge counts as three places at most. An edge may also lack contrast or be hidden, and then shows
    nothing: with the likelihood ratio Λ of its places, it counts log(q Λ + 1 - q).

    Args:
        seen: the measurement at a pose.
        other: all places on edges that may show at the other pose.
        camera: the camera's model.
        chance: fraction of the places that is found at wrong poses.
    """
    own, T = seen.samples, seen.T_camera_target
    points_px = camera.project(transform_points(T, own.points))  # the fit has moved them
    apart = TOLERANCE_PX * seen.blur
    alone = ~beside(points_px, own.normals, other.points_px, other.normals, apart)
    if not alone.any():
        return 0.0
    nats = place_nats(seen, chance, _FOUND, PRECISE_PX)[alone]
    _, edge, places = np.unique(own.edge[alone], return_inverse=True, return_counts=True)
    of_edge = np.bincount(edge, nats) / places * np.minimum(places / ALIKE, MOST_OF_EDGE)
    return float(np.logaddexp(np.log(_SHOWS) + of_edge, np.log(1.0 - _SHOWS)).sum())


@njit(cache=True)
def beside(
    points_px: FloatArray,
    normals: FloatArray,
    others_px: FloatArray,
    other_normals: FloatArray,
    apart_px: float,
) -> BoolArray:
    """Return which places on edges coincide with others, (N,).

    Args:
        points_px: the places, (N, 2).
        normals: of their edges, (N, 2) unit.
        others_px: the others, (M, 2), at most `_ALONG_PX` apart along their edges.
        other_normals: of their edges, (M, 2) unit.
        apart_px: distance across the edges within which they coincide.
    """
    coincide = np.zeros(len(points_px), dtype=np.bool_)
    for n in range(len(points_px)):
        nu, nv = normals[n, 0], normals[n, 1]
        for m in range(len(others_px)):
            du, dv = others_px[m, 0] - points_px[n, 0], others_px[m, 1] - points_px[n, 1]
            parallel = abs(nu * other_normals[m, 0] + nv * other_normals[m, 1]) > _PARALLEL
            across, along = abs(du * nu + dv * nv), abs(dv * nu - du * nv)
            if parallel and across < apart_px and along < _ALONG_PX:
                coincide[n] = True
                break
    return coincide
