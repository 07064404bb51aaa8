"""Rotations under which the outline of an object hardly moves, combined with any translation.

The outline of an ellipsoid is an ellipse, which has five parameters, so one of its six degrees of
freedom is never observable. The outline of a mug does not show its rotation while the handle is
hidden.
"""

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.camera.lens import pack_lens
from vergence.geometry import se3, so3_exp
from vergence.vision.known_object.contour_fit import outline_motion
from vergence.vision.known_object.object_model import ObjectModel
from vergence.vision.known_object.silhouette import outline_of
from vergence.vision.known_object.symmetry import FreeAxes

# Relative to half the object's size: motion of the outline per radian above which a rotation is
# observable. A turn of 0.1 rad then moves the outline by about what all images have wrong alike.
_USUAL = 0.01
_OF_ELLIPSOIDS = 0.03, 0.02  # of the weakest rotation of what is like an ellipsoid, of the others
_HIDDEN = 0.02  # motion in the view that shows a rotation least, below which it may be hidden
_LIKE_ELLIPSOID = 0.0145  # smallest motion, as a median over views
_CAMERA = Camera(400, 400, 600.0, 600.0, 199.5, 199.5)
_VIEWS = 15
_PLACES = 200


def weak_turns(
    slopes: FloatArray, free: FloatArray, half_px: float, of_ellipsoid: bool
) -> FloatArray:
    """Return the motions (δp, δθ) that hardly move an outline, (6, K), with unit rotations.

    Args:
        slopes: motion of each place across the outline by (δp, δθ), (N, 6), px.
        free: motions known to be unobservable, (6, F); those returned rotate differently.
        half_px: half the object's size in the image.
        of_ellipsoid: whether the object is like an ellipsoid, see `like_ellipsoid`.
    """
    squares, motions = _shown(slopes, free)
    weakest, others = _OF_ELLIPSOIDS if of_ellipsoid else (_USUAL, _USUAL)
    least = np.full(len(squares), others * half_px)
    least[:1] = weakest * half_px
    return motions[:, squares < least**2]


def weakest_turns(slopes: FloatArray, free: FloatArray) -> FloatArray:
    """Return the motions (δp, δθ), with unit rotations, that move an outline least: (6, K ≤ 2).

    Args:
        slopes: motion of each place across the outline by (δp, δθ), (N, 6), px.
        free: motions known to be unobservable, (6, F); those returned rotate differently.
    """
    return _shown(slopes, free)[1][:, :2]


def like_ellipsoid(model: ObjectModel, axes: FreeAxes) -> bool:
    """Return whether an object is similar to an ellipsoid.

    It then has a rotation that is never observable, whatever a single image suggests.
    """
    least = [share for share, _ in _views(model, axes, _VIEWS)]
    return bool(least) and float(np.median(least)) < _LIKE_ELLIPSOID


def hidden_turn_of(model: ObjectModel, axes: FreeAxes) -> FloatArray:
    """Return a motion (δp, δθ) that some views do not show, (6,), along the axes of the object.

    A mug with a hidden handle rotates about the axis of its body. It is zero if there is none.
    """
    views = _views(model, axes, 2 * _VIEWS)
    share, motion = min(views, key=lambda view: view[0], default=(np.inf, np.zeros(6)))
    return motion if share < _HIDDEN else np.zeros(6)


def _views(model: ObjectModel, axes: FreeAxes, count: int) -> list[tuple[float, FloatArray]]:
    """Return how far the weakest turn moves the outline in random views, and its motion (6,).

    The distance is relative to half the object's size, the motion along the object's axes.
    """
    random = np.random.default_rng(0)
    middle = 0.5 * (model.vertices.min(axis=0) + model.vertices.max(axis=0))
    lens, closed, views = pack_lens(_CAMERA), model.closed, []
    for _ in range(count):
        R = so3_exp(random.normal(0.0, 1.2, 3))
        T = se3(R, np.array((0.0, 0.0, 3.0 * model.size)) - R @ middle)
        outline = outline_of(T, lens, model.vertices, model.triangles, closed, _PLACES)
        if outline is None:  # thinner than a cell
            continue
        squares, motions = _shown(outline_motion(T, lens, outline)[1], axes.motions(T))
        if len(squares):
            share = np.sqrt(max(squares[0], 0.0)) * T[2, 3] / (0.5 * model.size * lens[0])
            views.append((float(share), np.concatenate(np.split(motions[:, 0], 2) @ R)))
    return views


def _shown(slopes: FloatArray, free: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean square motions of the outline, (K,) ascending, and the motions, (6, K).

    Each rotation is combined with the translation that moves the outline least.
    """
    if len(slopes) < 6 or free.shape[1] == 3:
        return np.zeros(0), np.zeros((6, 0))
    along = np.linalg.lstsq(slopes[:, :3], slopes[:, 3:], rcond=1e-6)[0]
    left = slopes[:, 3:] - slopes[:, :3] @ along
    others = np.linalg.svd(free[3:], full_matrices=True)[0][:, free.shape[1] :]
    squares, turns = np.linalg.eigh((left @ others).T @ (left @ others) / len(slopes))
    turns = others @ turns
    return squares, np.vstack((-along @ turns, turns))
