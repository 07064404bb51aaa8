"""Images of a jug whose handle passes beside its body, over coloured clutter."""

import cv2
import numpy as np
from ball_scene import FINE
from known_scene import CAMERA

from vergence.arrays import FloatArray, ImageArray
from vergence.geometry import se3, so3_exp
from vergence.studies.region.objects import OBJECTS
from vergence.vision.known_object import ObjectModel
from vergence.vision.known_object.silhouette import Grid, draw_nearness, project_vertices

JUG = ObjectModel.from_mesh("jug", *OBJECTS["jug"]())
_COLOR = (90, 70, 160)
_UPRIGHT = so3_exp(np.array((np.pi / 2, 0.0, 0.0)))


def jug_pose(turn_rad: float) -> FloatArray:
    """Return the pose (4, 4) of an upright jug; at 0 its handle is farthest to the right."""
    R = so3_exp(np.array((0.15, 0.0, 0.0))) @ _UPRIGHT @ so3_exp(np.array((0.0, 0.0, turn_rad)))
    return se3(np.ascontiguousarray(R), np.array((0.0, 0.0, 0.6)))


def drawn_jug(T: FloatArray, rng: np.random.Generator, ground: ImageArray) -> ImageArray:
    """Return an image (height, width, 3) of a jug at a pose (4, 4)."""
    fine = cv2.resize(ground, None, fx=FINE, fy=FINE, interpolation=cv2.INTER_NEAREST)
    projected = np.empty((len(JUG.vertices), 3))
    project_vertices(T, JUG.vertices, projected, np.empty(4))
    cell = 1.0 / (CAMERA.fx * FINE)
    left, top = (-np.array((CAMERA.cx, CAMERA.cy)) - 0.5) / CAMERA.fx + 0.5 * cell
    grid = Grid(float(left), float(top), cell, FINE * CAMERA.width, FINE * CAMERA.height)
    fine[draw_nearness(projected, JUG.triangles, grid, True) > 0.0] = _COLOR
    image = cv2.resize(fine, (CAMERA.width, CAMERA.height), interpolation=cv2.INTER_AREA)
    noisy = image + rng.normal(0.0, 2.0, image.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
