"""Places along the sharp edges of an object, and the image steps across each of them."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, ImageArray, IntArray
from vergence.camera.lens import HEIGHT, WIDTH, pixel_of
from vergence.vision.known_object.profiles import SHARP_WIDTH, find_steps, read_profile
from vergence.vision.known_object.projection import (
    edge_faces_camera,
    face_cosines,
    face_table,
    hidden,
    in_camera,
)

TEMPLATE = 4  # remembered samples on each side of an edge
LEAST_HALF = 17  # samples of a profile to each side, to follow blurred edges
LEAST_COSINE = 0.08  # flatter faces make no edge distinguishable from its neighbour
BORDER_PX = 3.0  # nothing is expected closer to the border of the image
_ALONG = 1e-3  # of an edge's length, for computing its direction in the image
_USUAL_HEIGHT = 15.0  # grey values: a step of this height has half the weight of the highest


class EdgeSamples(NamedTuple):
    """Places on edges that should be visible in an image."""

    edge: IntArray  # (N,) which edge
    place: IntArray  # (N,) index of the place on the edge
    points: FloatArray  # (N, 3) object's frame, m
    points_px: FloatArray  # (N, 2)
    normals: FloatArray  # (N, 2) unit normal of the edge in the image


class Steps(NamedTuple):
    """Image steps across each sample."""

    offsets: FloatArray  # (N, K) along the normal, px
    weights: FloatArray  # (N, K) 0 … 1; 0 where there is none
    widths: FloatArray  # (N, K) of the slope at half its height, px
    likeness: FloatArray  # (N, K) correlation with the remembered one, -1 … 1; NaN if none
    looks: FloatArray  # (N, K, 2 TEMPLATE + 1) grey profile around each, mean 0, norm 1
    readable: BoolArray  # (N,) the profile lies within the image


@njit(cache=True)
def sample_edges(
    T: FloatArray,
    lens: FloatArray,
    edges: FloatArray,
    edge_normals: FloatArray,
    surface: FloatArray,
    places: IntArray,
    least_cosine: float,
) -> EdgeSamples:
    """Return the places on sharp edges that are visible at a pose.

    Args:
        T: pose of the object in the camera, (4, 4).
        lens: packed camera, (11,).
        edges: ends of the sharp edges, (E, 2, 3), m.
        edge_normals: of the faces at each, (E, 2, 3).
        surface: occluding triangles, (F, 3, 3), m.
        places: number of places on each edge, evenly spaced, (E,).
        least_cosine: between the line of sight and the normal of a face that makes edges.
    """
    most = int(np.sum(places))
    edge, place = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    points, pixels, normals = np.empty((most, 3)), np.empty((most, 2)), np.empty((most, 2))
    table = face_table(T, surface)
    count = 0
    for e in range(len(edges)):
        along = edges[e, 1] - edges[e, 0]
        for k in range(places[e]):
            X = edges[e, 0] + ((k + 0.5) / places[e]) * along
            x, y, z = in_camera(T, X)
            if z <= 1e-6 or not edge_faces_camera(T, X, edge_normals[e], least_cosine):
                continue
            u, v = pixel_of(lens, x / z, y / z)
            within = (
                BORDER_PX <= u <= lens[WIDTH] - 1.0 - BORDER_PX
                and BORDER_PX <= v <= lens[HEIGHT] - 1.0 - BORDER_PX
            )
            if not within or hidden(table, x / z, y / z, z):
                continue
            x, y, z = in_camera(T, X + _ALONG * along)
            if z <= 1e-6:
                continue
            u1, v1 = pixel_of(lens, x / z, y / z)
            length = np.sqrt((u1 - u) ** 2 + (v1 - v) ** 2)
            if length < 1e-9:
                continue
            edge[count], place[count] = e, k
            points[count] = X
            pixels[count, 0], pixels[count, 1] = u, v
            normals[count, 0], normals[count, 1] = -(v1 - v) / length, (u1 - u) / length
            count += 1
    return EdgeSamples(edge[:count], place[:count], points[:count], pixels[:count], normals[:count])


@njit(cache=True)
def without_doubles(
    T: FloatArray, samples: EdgeSamples, edge_normals: FloatArray, apart_px: float
) -> EdgeSamples:
    """Drop the places that have another edge beside them, since the two could be confused.

    This happens where a face is seen at a grazing angle. Whether a face that is nearly edge-on is
    visible depends on a small error of the pose, so its edges are dropped in either case. If fewer
    than half of the places would remain, all of them are kept.

    Args:
        T: pose of the object in the camera, (4, 4).
        samples: on the edges, those of each edge consecutive.
        edge_normals: of the faces at each edge, (E, 2, 3).
        apart_px: smallest lateral distance of another edge.
    """
    count = len(samples.edge)
    alone = np.empty(count, dtype=np.bool_)
    for n in range(count):
        first, second = face_cosines(T, samples.points[n], edge_normals[samples.edge[n]])
        alone[n] = min(abs(first), abs(second)) > LEAST_COSINE
    runs, boxes = _edge_runs(samples, 1.5 * apart_px)
    for n in range(count):
        if not alone[n]:
            continue
        u, v = samples.points_px[n, 0], samples.points_px[n, 1]
        for r in range(len(runs)):
            if runs[r, 0] <= n < runs[r, 1]:
                continue
            if not (boxes[r, 0] <= u <= boxes[r, 1] and boxes[r, 2] <= v <= boxes[r, 3]):
                continue
            if _runs_beside(samples, n, runs[r, 0], runs[r, 1], apart_px):
                alone[n] = False
                break
    return samples if 2 * np.count_nonzero(alone) < count else chosen_samples(samples, alone)


@njit(cache=True)
def _edge_runs(samples: EdgeSamples, margin_px: float) -> tuple[IntArray, FloatArray]:
    """Return first and last + 1 sample of each edge, (R, 2), and the boxes around them, (R, 4)."""
    count = len(samples.edge)
    runs, boxes = np.empty((count, 2), dtype=np.int64), np.empty((count, 4))
    filled, first = 0, 0
    for n in range(1, count + 1):
        if n < count and samples.edge[n] == samples.edge[first]:
            continue
        runs[filled, 0], runs[filled, 1] = first, n
        for axis in range(2):
            along = samples.points_px[first:n, axis]
            boxes[filled, 2 * axis] = along.min() - margin_px
            boxes[filled, 2 * axis + 1] = along.max() + margin_px
        filled, first = filled + 1, n
    return runs[:filled], boxes[:filled]


@njit(cache=True)
def _runs_beside(samples: EdgeSamples, n: int, first: int, last: int, apart_px: float) -> bool:
    """Return whether one of the samples first … last - 1 lies to the side of sample n, parallel."""
    p, normal = samples.points_px[n], samples.normals[n]
    for m in range(first, last):
        du, dv = samples.points_px[m, 0] - p[0], samples.points_px[m, 1] - p[1]
        across = abs(du * normal[0] + dv * normal[1])
        along = abs(dv * normal[0] - du * normal[1])
        if 0.5 < across < apart_px and along < apart_px:
            other = samples.normals[m]
            if abs(normal[0] * other[0] + normal[1] * other[1]) > 0.9:
                return True
    return False


@njit(cache=True)
def chosen_samples(samples: EdgeSamples, chosen: BoolArray) -> EdgeSamples:
    """Return a subset of the samples, chosen (N,)."""
    return EdgeSamples(
        samples.edge[chosen],
        samples.place[chosen],
        samples.points[chosen],
        samples.points_px[chosen],
        samples.normals[chosen],
    )


@njit(cache=True)
def search_steps(
    image: ImageArray,
    samples: EdgeSamples,
    reach: int,
    contrast: float,
    candidates: int,
    templates: FloatArray,
    known: BoolArray,
) -> Steps:
    """Find the steps across each sample, and their similarity to the remembered appearance.

    Args:
        image: grey, (height, width).
        samples: where to search.
        reach: search distance to either side, px.
        contrast: smallest height of a step, grey values.
        candidates: number of steps to keep per sample.
        templates: remembered appearance of every place on every edge, (E, places, 2 TEMPLATE + 1).
        known: whether there is one, (E, places).
    """
    count = len(samples.edge)
    offsets, weights = np.zeros((count, candidates)), np.zeros((count, candidates))
    likeness = np.full((count, candidates), np.nan)
    looks = np.zeros((count, candidates, 2 * TEMPLATE + 1))
    readable = np.zeros(count, dtype=np.bool_)
    # The appearance of an edge is read around a step at the end of the reach as well.
    profile = np.empty(2 * max(reach + TEMPLATE + 2, LEAST_HALF) + 1)
    places, heights = np.empty(candidates), np.empty(candidates)
    widths = np.zeros((count, candidates))
    for n in range(count):
        p, normal = samples.points_px[n], samples.normals[n]
        readable[n] = read_profile(image, p[0], p[1], normal[0], normal[1], profile)
        if not readable[n]:
            continue
        e, k = samples.edge[n], samples.place[n]
        for j in range(find_steps(profile, reach, contrast, places, heights, widths[n])):
            size = abs(heights[j])
            offsets[n, j] = places[j]
            weights[n, j] = size / (size + _USUAL_HEIGHT) * min(1.0, SHARP_WIDTH / widths[n, j])
            look_at(profile, places[j], looks[n, j])
            if known[e, k]:
                match = 0.0
                for i in range(2 * TEMPLATE + 1):
                    match += templates[e, k, i] * looks[n, j, i]
                likeness[n, j] = match
                weights[n, j] *= 0.2 + 0.8 * max(match, 0.0) ** 2
    return Steps(offsets, weights, widths, likeness, looks, readable)


@njit(cache=True)
def look_at(profile: FloatArray, offset: float, look: FloatArray) -> None:
    """Fill look with the profile around an offset from its centre, mean 0 and norm 1."""
    place = len(profile) // 2 + offset - TEMPLATE
    first = int(place)
    share = place - first
    total, squares = 0.0, 1e-24
    for i in range(2 * TEMPLATE + 1):
        grey = profile[first + i] + share * (profile[first + i + 1] - profile[first + i])
        look[i] = grey
        total += grey
    mean = total / (2 * TEMPLATE + 1)
    for i in range(2 * TEMPLATE + 1):
        look[i] -= mean
        squares += look[i] * look[i]
    scale = 1.0 / np.sqrt(squares)
    for i in range(2 * TEMPLATE + 1):
        look[i] *= scale
