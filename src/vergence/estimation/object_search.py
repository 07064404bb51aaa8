"""Where an object is that was lost: the places around where it was seen last are tried in turn."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.camera.lens import pack_lens
from vergence.vision.known_object.pose_fit import shifted

_STEP_PX = 32.0  # between places; each is searched farther than half of it
_FARTHEST_PX = 128.0
_WIDENING_PX = 32.0  # by each image without the object
_APART_PX = 8.0  # of two places where it may be


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
    """Return the pose (4, 4) at which most of an object is found; None if no one place shows it.

    Args:
        tracker: measures the object.
        image: as the tracker takes it.
        camera: the camera's model.
        T_last: pose where it was seen last, (4, 4).
        covariance: (6, 6), how far around each place to search.
        memory: what the object looked like.
        missed: images since then: the longer ago, the farther away it may be.
        least_share: of what should be seen, and of what usually is, that has to be found.
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
    """Yield the pose moved across the image, (4, 4) each, the nearest first."""
    count = int(farthest_px // _STEP_PX)
    steps = _STEP_PX * np.arange(-count, count + 1)
    shifts = np.array(np.meshgrid(steps, steps)).reshape(2, -1).T
    away = np.linalg.norm(shifts, axis=1)
    for k in np.argsort(away, kind="stable"):
        if away[k] <= farthest_px:
            yield shifted(np.ascontiguousarray(T), lens, shifts[k, 0], shifts[k, 1])
