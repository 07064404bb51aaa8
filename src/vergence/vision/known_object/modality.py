"""Decides whether the sharp edges of an object determine its pose, or its outline must."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.camera.lens import pack_lens
from vergence.geometry import se3, so3_exp
from vergence.vision.known_object.object_model import ObjectModel
from vergence.vision.known_object.silhouette import outline_of

LEAST_SHARE = 0.7  # fraction of the outline on sharp edges
_NEAR = 0.01  # relative to the object's size
_CAMERA = Camera(400, 400, 600.0, 600.0, 199.5, 199.5)
_VIEWS_RAD = ((0.5, 0.3, 0.0), (1.3, 0.2, 0.4), (0.4, 1.2, -0.5), (2.2, 0.5, 0.6), (0.3, -0.9, 1.1))


def shown_by_edges(model: ObjectModel) -> bool:
    """Return whether an object has corners and most of its outline follows sharp edges.

    A box qualifies; a can has two sharp rims, but round sides.
    """
    if not len(model.corners):
        return False
    shares = [_share_on_edges(model, np.array(turn)) for turn in _VIEWS_RAD]
    return float(np.mean(shares)) >= LEAST_SHARE


def has_corners(model: ObjectModel) -> bool:
    """Return whether sharp edges of an object meet; those of a box around it do not count."""
    return bool((model.corner_edges >= 0).any())


def as_followed(model: ObjectModel) -> ObjectModel:
    """Return an object with points that represent it: its corners, or those of a box inside."""
    return model if has_corners(model) or shown_by_edges(model) else model.boxed()


def _share_on_edges(model: ObjectModel, turn: FloatArray) -> float:
    middle = 0.5 * (model.vertices.min(axis=0) + model.vertices.max(axis=0))
    R = so3_exp(turn)
    T = se3(R, np.array((0.0, 0.0, 3.0 * model.size)) - R @ middle)
    closed = model.closed
    outline = outline_of(T, pack_lens(_CAMERA), model.vertices, model.triangles, closed, 100)
    if outline is None:  # thinner than a cell, such as a plate seen edge-on
        return 1.0
    start, along = model.edges[:, 0], model.edges[:, 1] - model.edges[:, 0]
    ahead = outline.points[:, None] - start
    place = np.clip(np.einsum("nej,ej->ne", ahead, along) / np.sum(along**2, axis=1), 0.0, 1.0)
    away = np.linalg.norm(ahead - place[..., None] * along, axis=2).min(axis=1)
    return float(np.mean(away < _NEAR * model.size))
