"""Corners of a known object in windows of an image."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, ImageArray, IntArray
from vergence.camera import Camera
from vergence.camera.lens import pack_lens, pixel_of
from vergence.errors import Absent, InputError
from vergence.vision.known_object.corner_fit import FOUND, LONGEST_PX, TOO_FEW, fit_corner
from vergence.vision.known_object.object_model import ObjectModel
from vergence.vision.known_object.projection import edge_faces_camera, face_table, hidden, in_camera

REASONS = (
    "",
    "outside the image",
    "no contrast",
    "edges inconsistent",
    "fewer than two edges seen",
    "left its window",
)
CROWDED_VARIANCE = 1.0  # px², of a corner whose edges may be confused with their neighbours
_LEAST_COSINE = 0.05  # flatter faces make no edge distinguishable from its neighbour


class CornerMeasurements(NamedTuple):
    """The measurements in the windows of one image."""

    points_px: FloatArray  # (M, 2); the predicted position if nothing was found
    covariance_px: FloatArray  # (M, 2, 2) px²
    found: BoolArray  # (M,)
    reasons: tuple[str, ...]  # (M,) empty if found, else why not


@njit(cache=True)
def measure_corners(
    image: ImageArray,
    T: FloatArray,
    lens: FloatArray,
    corners: FloatArray,
    corner_edges: IntArray,
    edges: FloatArray,
    edge_normals: FloatArray,
    surface: FloatArray,
    chosen: IntArray,
    half_px: FloatArray,
    contrast: float,
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Measure the chosen corners; return positions (M, 2), covariances (M, 2, 2) and codes (M,).

    Args:
        image: grey, (height, width).
        T: predicted pose of the object in the camera, (4, 4).
        lens: packed camera, (11,).
        corners: of the object, (C, 3), m.
        corner_edges: the edges at each, (C, K).
        edges: ends of the sharp edges, (E, 2, 3), m.
        edge_normals: of the faces at each, (E, 2, 3).
        surface: occluding triangles, (F, 3, 3), m.
        chosen: indices of the corners, (M,).
        half_px: half sizes of the windows around their predicted positions, (M, 2).
        contrast: smallest step of an edge, grey values.
    """
    places = np.empty((len(chosen), 2))
    covariances = np.zeros((len(chosen), 2, 2))
    codes = np.empty(len(chosen), dtype=np.int64)
    table = face_table(T, surface)
    lines = _lines(T, lens, edges, edge_normals)
    directions = np.empty((corner_edges.shape[1], 2))
    lengths = np.empty(corner_edges.shape[1])
    arm = np.empty(2)
    for m in range(len(chosen)):
        X = corners[chosen[m]]
        x, y, z = in_camera(T, X)
        if not z > 0.0:
            places[m] = np.nan
            codes[m] = 1
            continue
        u, v = pixel_of(lens, x / z, y / z)
        places[m, 0], places[m, 1] = u, v
        apart = 2.0 + 0.35 * min(half_px[m, 0], half_px[m, 1])
        alone, crowded = 0, 0  # isolated arms come first, the others from the end
        for k in range(corner_edges.shape[1]):
            e = corner_edges[chosen[m], k]
            if e < 0 or not edge_faces_camera(T, X, edge_normals[e], _LEAST_COSINE):
                continue
            length = _arm(T, lens, X, edges[e], table, u, v, arm)
            if length == 0.0:
                continue
            if _crowded(lines, e, u, v, arm, length, apart):
                crowded += 1
                row = len(lengths) - crowded
            else:
                row = alone
                alone += 1
            directions[row], lengths[row] = arm, length
        count = alone
        if alone < 2:  # then the others are used, with less weight
            for k in range(len(lengths) - crowded, len(lengths)):
                directions[count], lengths[count] = directions[k], lengths[k]
                count += 1
        if count < 2:
            codes[m] = TOO_FEW
            continue
        found = np.empty(2)
        codes[m] = fit_corner(
            image,
            u,
            v,
            directions[:count],
            lengths[:count],
            half_px[m],
            contrast,
            found,
            covariances[m],
        )
        if codes[m] == FOUND:
            places[m] = found
            if alone < 2:
                covariances[m, 0, 0] += CROWDED_VARIANCE
                covariances[m, 1, 1] += CROWDED_VARIANCE
    return places, covariances, codes


@njit(cache=True)
def _lines(
    T: FloatArray, lens: FloatArray, edges: FloatArray, edge_normals: FloatArray
) -> FloatArray:
    """Return both ends in the image of each edge that faces the camera, (E, 4), else NaN."""
    lines = np.full((len(edges), 4), np.nan)
    for e in range(len(edges)):
        x0, y0, z0 = in_camera(T, edges[e, 0])
        x1, y1, z1 = in_camera(T, edges[e, 1])
        if min(z0, z1) <= 1e-6 or not edge_faces_camera(T, edges[e, 0], edge_normals[e], 0.0):
            continue
        lines[e, 0], lines[e, 1] = pixel_of(lens, x0 / z0, y0 / z0)
        lines[e, 2], lines[e, 3] = pixel_of(lens, x1 / z1, y1 / z1)
    return lines


@njit(cache=True)
def _crowded(
    lines: FloatArray,
    own: int,
    u: float,
    v: float,
    direction: FloatArray,
    length: float,
    apart_px: float,
) -> bool:
    """Return whether another edge runs beside an arm, so that the two may be confused."""
    at = 0.5 * min(length, LONGEST_PX)
    x, y = u + at * direction[0], v + at * direction[1]
    for e in range(len(lines)):
        du, dv = lines[e, 2] - lines[e, 0], lines[e, 3] - lines[e, 1]
        size = np.sqrt(du * du + dv * dv)
        if e == own or not size > 0.0:
            continue
        du, dv = du / size, dv / size
        along = (x - lines[e, 0]) * du + (y - lines[e, 1]) * dv
        across = abs((y - lines[e, 1]) * du - (x - lines[e, 0]) * dv)
        parallel = abs(du * direction[0] + dv * direction[1]) > 0.9
        if parallel and -apart_px < along < size + apart_px and across < apart_px:
            return True
    return False


@njit(cache=True)
def _arm(
    T: FloatArray,
    lens: FloatArray,
    X: FloatArray,
    edge: FloatArray,
    table: FloatArray,
    u: float,
    v: float,
    direction: FloatArray,
) -> float:
    """Fill the image direction of an edge from X on; return its length, 0 if occluded.

    An edge that extends behind the camera is clipped.
    """
    first = 0.0
    for j in range(3):
        first += (edge[0, j] - X[j]) ** 2 - (edge[1, j] - X[j]) ** 2
    near, far = (0, 1) if first < 0.0 else (1, 0)
    length = 0.0
    share = 1.0
    for _ in range(6):
        P = edge[near] + share * (edge[far] - edge[near])
        x, y, z = in_camera(T, P)
        if z > 1e-6:
            pu, pv = pixel_of(lens, x / z, y / z)
            length = np.sqrt((pu - u) ** 2 + (pv - v) ** 2)
            if length < 40.0:
                break
        share *= 0.5
    if length < 1e-6:
        return 0.0
    direction[0], direction[1] = (pu - u) / length, (pv - v) / length
    for part in (0.25, 0.6):
        P = edge[near] + part * share * (edge[far] - edge[near])
        x, y, z = in_camera(T, P)
        if not hidden(table, x / z, y / z, z):
            return length
    return 0.0


@dataclass(frozen=True, slots=True)
class CornerExtractor:
    """Measures corners of a known object to a fraction of a pixel, in windows only.

    The edges that meet in a corner follow from the predicted pose. Each is searched for along lines
    across its prediction; the steps that most profiles agree on form a line, and the lines are
    intersected, with the covariance from their scatter.
    """

    model: ObjectModel
    contrast: float = 6.0  # smallest step of an edge, grey values

    def __post_init__(self) -> None:
        if not len(self.model.edges):
            allowed = "a model with edges, from a mesh"
            raise InputError(self.model.name, "edges", Absent("none"), allowed)
        if not self.contrast > 0.0:
            raise InputError("CornerExtractor", "contrast", self.contrast, "above zero")

    def measure(
        self,
        image: ImageArray,
        camera: Camera,
        T_camera_target: FloatArray,
        features: IntArray,
        half_px: FloatArray,
    ) -> CornerMeasurements:
        """Measure corners in windows around their predicted positions.

        Args:
            image: grey, of the camera's size, (height, width).
            camera: the camera's model.
            T_camera_target: predicted pose of the object in the camera, (4, 4).
            features: indices of the model's corners, (M,).
            half_px: half the width and height of each window, (M, 2), px.

        Raises:
            InputError: if the image is not grey 8 bit or not of the camera's size.
        """
        require_image(image, camera)
        model = self.model
        places, covariances, codes = measure_corners(
            np.ascontiguousarray(image),
            np.ascontiguousarray(T_camera_target),
            pack_lens(camera),
            model.corners,
            model.corner_edges,
            model.edges,
            model.edge_normals,
            model.surface,
            np.asarray(features, dtype=np.int64),
            np.asarray(half_px, dtype=np.float64),
            self.contrast,
        )
        reasons = tuple(REASONS[code] for code in codes)
        return CornerMeasurements(places, covariances, codes == FOUND, reasons)


def require_image(image: ImageArray, camera: Camera) -> None:
    """Raise InputError unless an image is grey, of 8 bit, and of the camera's size."""
    if image.ndim != 2 or image.dtype != np.uint8:
        given = f"{image.dtype} of shape {image.shape}"
        raise InputError("image", "", given, "8-bit grey of shape (height, width)")
    if image.shape != (camera.height, camera.width):
        given = f"{image.shape[1]} x {image.shape[0]} pixels"
        allowed = f"{camera.width} x {camera.height}, as the camera's intrinsics say"
        raise InputError("image", "", given, allowed)
