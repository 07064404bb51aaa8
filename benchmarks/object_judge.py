"""Whether a pose of a known object is right, judged by no tracker.

A pose *explains* an image if at more than 60 % of the places along the object's visible edges the
steepest grey value within ±10 px lies within 2 px.
"""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.camera.lens import pack_lens
from vergence.vision.known_object import ObjectModel
from vergence.vision.known_object.edge_samples import LEAST_COSINE, sample_edges

PLACES, BESIDE_PX, NEAR_PX, LEAST_SLOPE, HELD_SHARE = 20, 10.0, 2.0, 4.0, 0.6
_AWAY = np.arange(-BESIDE_PX, BESIDE_PX + 0.01, 0.5)


def explained_share(smooth: ImageArray, T: FloatArray, model: ObjectModel, camera: Camera) -> float:
    """The share of places along the visible edges that have the steepest grey value near them."""
    import cv2

    if not T[2, 3] > 0.0:
        return 0.0
    places = np.full(len(model.edges), PLACES)
    seen = sample_edges(
        np.ascontiguousarray(T), pack_lens(camera), model.edges, model.edge_normals, model.surface,
        places, LEAST_COSINE,
    )  # fmt: skip
    across = seen.points_px[:, None] + _AWAY[:, None] * seen.normals[:, None]
    inside = ((across > 2.0) & (across < (camera.width - 3, camera.height - 3))).all((1, 2))
    if not inside.any():
        return 0.0
    u, v = np.moveaxis(across[inside].astype(np.float32), 2, 0)
    grey = np.asarray(cv2.remap(smooth, u, v, cv2.INTER_LINEAR))
    slope = np.abs(grey[:, 2:] - grey[:, :-2])
    steepest = np.abs(_AWAY[1:-1][slope.argmax(axis=1)])
    return float(np.mean((slope.max(axis=1) > LEAST_SLOPE) & (steepest < NEAR_PX)))


def explained(
    images: Sequence[ImageArray], poses: Sequence[FloatArray], model: ObjectModel, camera: Camera
) -> list[bool]:
    """In which images the pose explains what is seen."""
    import cv2

    pairs = zip(images, poses, strict=True)
    smooth = ((cv2.GaussianBlur(image, (0, 0), 1.0).astype(np.float32), T) for image, T in pairs)
    return [explained_share(image, T, model, camera) > HELD_SHARE for image, T in smooth]


def shift_px(T: FloatArray, T_true: FloatArray, model: ObjectModel, camera: Camera) -> float:
    """How far apart two poses put the object's corners in the image, on average."""
    places = [model.corners @ pose[:3, :3].T + pose[:3, 3] for pose in (T, T_true)]
    if min(place[:, 2].min() for place in places) <= 0.0:
        return float("inf")
    one, other = (camera.project(place) for place in places)
    return float(np.linalg.norm(one - other, axis=1).mean())
