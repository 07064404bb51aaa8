"""Draws a followed object into its image."""

import numpy as np
from numpy.typing import NDArray

from vergence.app.overlay import DESIRED, FOUND, LOST
from vergence.app.tracking.banner import draw_banner
from vergence.app.tracking.tag_follower import Shown
from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.camera.lens import pack_lens
from vergence.estimation.known_object.object_follower import Sighting, Step
from vergence.estimation.known_object.object_tracker import ObjectTracker
from vergence.vision.known_object import ObjectModel, SilhouetteTracker
from vergence.vision.known_object.edge_samples import LEAST_COSINE, sample_edges
from vergence.vision.known_object.silhouette import outline_of

_SHIFT = 4  # fractional bits of a place
_PLACES = 60  # along an edge: where it comes out from behind something
_BESIDE_PX = 4.0  # places on one outline
AXES = ((0, 0, 230), (0, 180, 0), (230, 80, 0))  # x red, y green, z blue
_COLORS = {
    Sighting.SEEN: FOUND,
    Sighting.AMBIGUOUS: DESIRED,
    Sighting.PREDICTED: DESIRED,
    Sighting.LOST: LOST,
}


def draw_step(
    image: ImageArray, step: Step, tracker: ObjectTracker | Shown, camera: Camera
) -> NDArray[np.uint8]:
    """Return the image in colour with the object's outline or visible edges, and axes, over it.

    Args:
        image: (height, width) grey, or (height, width, 3).
        step: what was made of it.
        tracker: what measured the object.
        camera: the camera's model.

    Returns:
        (height, width, 3) blue, green, red.
    """
    import cv2

    grey = image.ndim == 2
    canvas = np.array(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if grey else image, dtype=np.uint8)
    T, model = np.ascontiguousarray(step.T_camera_target), tracker.model
    if T[2, 3] > 0.0:
        draw = _outline if isinstance(tracker, SilhouetteTracker) else _edges
        draw(canvas, T, model, camera, _COLORS[step.sighting])
        _axes(canvas, T, 0.25 * model.size, camera)
    for place, found in zip(step.samples_px, step.samples_found, strict=True):
        if not found:
            cv2.circle(canvas, _fixed(place), 1 << _SHIFT, LOST, -1, cv2.LINE_AA, _SHIFT)
    draw_banner(canvas, [f"{step.time:.2f} s  {step.sighting.value}  {step.share:.0%}"])
    return canvas


def _edges(
    canvas: NDArray[np.uint8],
    T: FloatArray,
    model: ObjectModel,
    camera: Camera,
    color: tuple[int, ...],
) -> None:
    import cv2

    places = np.full(len(model.edges), _PLACES)
    seen = sample_edges(
        T, pack_lens(camera), model.edges, model.edge_normals, model.surface, places, LEAST_COSINE
    )
    along = (np.diff(seen.edge) == 0) & (np.diff(seen.place) == 1)
    for n in np.flatnonzero(along):
        ends = _fixed(seen.points_px[n]), _fixed(seen.points_px[n + 1])
        cv2.line(canvas, *ends, color, 1, cv2.LINE_AA, _SHIFT)


def _outline(
    canvas: NDArray[np.uint8],
    T: FloatArray,
    model: ObjectModel,
    camera: Camera,
    color: tuple[int, ...],
) -> None:
    import cv2

    closed = False  # faces seen from behind change nothing, and cost little here
    seen = outline_of(T, pack_lens(camera), model.vertices, model.triangles, closed, 10**6)
    if seen is None:
        return
    apart = np.linalg.norm(np.diff(seen.points_px, axis=0), axis=1)
    for n in np.flatnonzero(apart < _BESIDE_PX):
        ends = _fixed(seen.points_px[n]), _fixed(seen.points_px[n + 1])
        cv2.line(canvas, *ends, color, 2, cv2.LINE_AA, _SHIFT)


def _axes(canvas: NDArray[np.uint8], T: FloatArray, length: float, camera: Camera) -> None:
    import cv2

    points = T[:3, 3] + np.vstack((np.zeros(3), length * T[:3, :3].T))
    if not (points[:, 2] > 0.0).all():
        return
    pixels = camera.project(points)
    if not (np.abs(pixels) < 1e4).all():
        return
    for end, color in zip(pixels[1:], AXES, strict=True):
        cv2.line(canvas, _fixed(pixels[0]), _fixed(end), color, 2, cv2.LINE_AA, _SHIFT)


def _fixed(point: FloatArray) -> tuple[int, int]:
    u, v = (round(float(value) * 2**_SHIFT) for value in point)
    return u, v
