"""Places along the sharp edges of an object, and the steps in the image beside each of them."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, ImageArray, IntArray
from vergence.camera.lens import HEIGHT, WIDTH, pixel_of
from vergence.vision.known_object.profiles import MARGIN, SHARP_WIDTH, find_steps, read_profile
from vergence.vision.known_object.projection import edge_faces_camera, face_table, hidden, in_camera

TEMPLATE = 4  # samples on each side of an edge that are remembered
BLUR = 9  # samples by which a profile is longer than the search, to follow blurred edges
LEAST_COSINE = 0.08  # flatter faces make no edge to be told from its neighbour
BORDER_PX = 3.0  # nearer to the border of the image nothing is expected
_ALONG = 1e-3  # of an edge's length, for its direction in the image
_USUAL_HEIGHT = 15.0  # grey values: a step of this height has half the weight of the highest


class EdgeSamples(NamedTuple):
    """Places on edges that should be seen in an image."""

    edge: IntArray  # (N,) which edge
    place: IntArray  # (N,) which of its places
    points: FloatArray  # (N, 3) object's frame, m
    points_px: FloatArray  # (N, 2)
    normals: FloatArray  # (N, 2) unit normal of the edge in the image


class Steps(NamedTuple):
    """Steps in the image across each sample."""

    offsets: FloatArray  # (N, K) along the normal, px
    weights: FloatArray  # (N, K) 0 … 1; 0 where there is none
    widths: FloatArray  # (N, K) of the slope at half its height, px
    likeness: FloatArray  # (N, K) correlation with what is remembered, -1 … 1; NaN if nothing is
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
) -> EdgeSamples:
    """Return the places on sharp edges that are seen under a pose.

    Args:
        T: pose of the object in the camera, (4, 4).
        lens: packed camera, (11,).
        edges: ends of the sharp edges, (E, 2, 3), m.
        edge_normals: of the faces at each, (E, 2, 3).
        surface: triangles that hide, (F, 3, 3), m.
        places: how many places each edge has, evenly spaced, (E,).
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
            if z <= 1e-6 or not edge_faces_camera(T, X, edge_normals[e], LEAST_COSINE):
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
def without_doubles(samples: EdgeSamples, apart_px: float) -> EdgeSamples:
    """Leave out the places that another edge runs beside, for one would be taken for the other.

    So it is where a face is seen at a grazing angle. If that would leave less than half of the
    places, all of them stay.

    Args:
        samples: on the edges.
        apart_px: how far to the side another edge has to be.
    """
    count = len(samples.edge)
    alone = np.ones(count, dtype=np.bool_)
    for n in range(count):
        p, normal = samples.points_px[n], samples.normals[n]
        for m in range(count):
            if samples.edge[m] == samples.edge[n]:
                continue
            du, dv = samples.points_px[m, 0] - p[0], samples.points_px[m, 1] - p[1]
            if abs(du) > 1.5 * apart_px or abs(dv) > 1.5 * apart_px:
                continue
            across = abs(du * normal[0] + dv * normal[1])
            along = abs(dv * normal[0] - du * normal[1])
            parallel = normal[0] * samples.normals[m, 0] + normal[1] * samples.normals[m, 1]
            if 0.5 < across < apart_px and along < apart_px and abs(parallel) > 0.9:
                alone[n] = False
                break
    if 2 * np.count_nonzero(alone) < count:
        return samples
    return EdgeSamples(
        samples.edge[alone],
        samples.place[alone],
        samples.points[alone],
        samples.points_px[alone],
        samples.normals[alone],
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
    """Find the steps across each sample, and how much each looks like what is remembered there.

    Args:
        image: grey, (height, width).
        samples: where to look.
        reach: how far to either side, px.
        contrast: least height of a step, grey values.
        candidates: how many to keep of each.
        templates: what every place of every edge looked like, (E, places, 2 TEMPLATE + 1).
        known: whether anything is remembered of it, (E, places).
    """
    count = len(samples.edge)
    offsets, weights = np.zeros((count, candidates)), np.zeros((count, candidates))
    likeness = np.full((count, candidates), np.nan)
    looks = np.zeros((count, candidates, 2 * TEMPLATE + 1))
    readable = np.zeros(count, dtype=np.bool_)
    profile = np.empty(2 * (reach + MARGIN + BLUR) + 1)
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
    """Fill look with the profile around an offset from its middle, mean 0 and norm 1."""
    middle = len(profile) // 2
    mean = 0.0
    for i in range(len(look)):
        s = middle + offset + i - TEMPLATE
        k = int(s)
        look[i] = (1.0 - s + k) * profile[k] + (s - k) * profile[k + 1]
        mean += look[i] / len(look)
    norm = 1e-12
    for i in range(len(look)):
        look[i] -= mean
        norm += look[i] * look[i]
    norm = np.sqrt(norm)
    for i in range(len(look)):
        look[i] /= norm


@njit(cache=True)
def vote_shift(samples: EdgeSamples, steps: Steps, reach: int) -> tuple[float, float]:
    """Return the shift of the whole image of the object, px, that most steps support.

    Every whole-pixel shift within the reach is tried: shifting by d moves an edge by n · d, and the
    best step within two pixels of it supports it. Small shifts win where support is equal.
    """
    best, best_x, best_y = -1.0, 0, 0
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            if dx * dx + dy * dy > reach * reach:
                continue
            score = 0.0
            for n in range(len(samples.edge)):
                expected = samples.normals[n, 0] * dx + samples.normals[n, 1] * dy
                most = 0.0
                for j in range(steps.offsets.shape[1]):
                    miss = 0.5 * (steps.offsets[n, j] - expected)
                    if abs(miss) < 1.0:
                        most = max(most, steps.weights[n, j] * (1.0 - miss * miss))
                score += most
            score *= 1.0 - 0.25 * np.sqrt(dx * dx + dy * dy) / reach
            if score > best:
                best, best_x, best_y = score, dx, dy
    return float(best_x), float(best_y)
