"""Search for a lost object at positions around the last one, nearest first."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.camera.lens import pack_lens
from vergence.vision.known_object.pose_fit import shifted

_STEP_PX = 32.0  # between positions; each search covers more than half of it
_FARTHEST_PX = 128.0
_WIDENING_PX = 32.0  # per image without the object
_APART_PX = 8.0  # between two positions where it may be


def search_object(
    tracker: Any,
    image: ImageArray,
    camera: Camera,
    T_last: FloatArray,
    covariance: FloatArray,
    memory: Any,
    missed: int,
    least_share: float,
) -> FloatArray | None:
    """Return the pose (4, 4) at which most of an object is found; None if no single one stands out.

    Args:
        tracker: measures the object.
        image: in the form that the tracker takes.
        camera: the camera's model.
        T_last: last pose, (4, 4).
        covariance: (6, 6), size of the search around each position.
        memory: appearance of the object.
        missed: images since then; the search widens with each.
        least_share: fraction of what should be visible, and of what usually is, that must be found.
    """
    found = []
    for T in _places(T_last, pack_lens(camera), min(_WIDENING_PX * missed, _FARTHEST_PX)):
        seen = tracker.measure(image, camera, T, covariance, memory)
        share = min(seen.share, seen.usual)
        if share >= least_share and len(seen.points) and seen.T_camera_target[2, 3] > 0.0:
            found.append((share, seen.T_camera_target))
    if not found:
        return None
    best = max(found, key=lambda each: each[0])[1]
    place = camera.project(best[None, :3, 3])[0]
    elsewhere = any(
        np.linalg.norm(camera.project(T[None, :3, 3])[0] - place) > _APART_PX for _, T in found
    )
    return None if elsewhere else best


def _places(T: FloatArray, lens: FloatArray, farthest_px: float) -> Iterator[FloatArray]:
    """Yield poses moved across the image, (4, 4) each, the nearest first."""
    count = int(farthest_px // _STEP_PX)
    steps = _STEP_PX * np.arange(-count, count + 1)
    shifts = np.array(np.meshgrid(steps, steps)).reshape(2, -1).T
    away = np.linalg.norm(shifts, axis=1)
    for k in np.argsort(away, kind="stable"):
        if away[k] <= farthest_px:
            yield shifted(np.ascontiguousarray(T), lens, shifts[k, 0], shifts[k, 1])
