"""Tracked points of rendered surfaces: texture, marks that look alike, straight edges, hidden."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.studies.honesty.answer import UNFOUNDED, Answer, deviations_of, refused
from vergence.studies.honesty.images import FINE, blobs, lettering, seen, straight_edges, turn
from vergence.vision import SsdTracker

KINDS = ("texture", "look-alikes", "straight edge", "hidden")
SIDE_PX = 128
_SURFACE = (SIDE_PX + 64) * FINE  # samples
_MIDDLE = np.full(2, 0.5 * (SIDE_PX - 1))
_SURFACES = {
    "texture": blobs,
    "look-alikes": lettering,
    "straight edge": straight_edges,
    "hidden": blobs,
}
_HIDDEN_PX = 24.0  # half the side of what hides a point


def try_scene(random: np.random.Generator, number: int) -> list[Answer]:
    """Track five points from one random image of a surface to another."""
    kind = KINDS[number % len(KINDS)]
    surface = _SURFACES[kind](random, _SURFACE)
    noise = random.uniform(0.5, 4.0)
    places = random.uniform(-24.0, 24.0, (5, 2))
    if kind == "straight edge":
        places = _on_edge(surface, places)
    A = _motion(random)
    first = seen(random, surface, np.eye(2, 3), SIDE_PX, noise)
    gain, bias = random.uniform(0.85, 1.15), random.uniform(-12.0, 12.0)
    second = seen(random, np.clip(gain * surface + bias, 0.0, 255.0), A, SIDE_PX, noise)
    truth = places @ A[:, :2].T + A[:, 2] + _MIDDLE
    if kind == "hidden":
        other = seen(random, blobs(random, _SURFACE), A, SIDE_PX, noise)
        off = np.abs(np.indices(other.shape)[::-1] - truth[0][:, None, None]).max(axis=0)
        second = np.where(off < _HIDDEN_PX, other, second)
        places, truth = places[:1], truth[:1]
    tracks = SsdTracker(first, places + _MIDDLE).track(second)
    name = f"point: {kind}"
    answers = []
    for k in range(len(truth)):
        if not tracks.found[k]:
            answers.append(refused(name, tracks.reasons[k], rightly=kind == "hidden"))
        elif kind == "hidden":
            answers.append(Answer(name, UNFOUNDED, 1))
        else:
            error = tracks.points_px[k] - truth[k]
            answers.append(Answer(name, deviations_of(error, tracks.covariance_px[k]), 1))
    return answers


def _motion(random: np.random.Generator) -> FloatArray:
    """Return an affine map (2, 3): a turn, a stretch, and a shift that the search reaches."""
    A = turn(np.deg2rad(random.uniform(-6.0, 6.0))) @ (
        np.eye(2) + random.uniform(-0.05, 0.05, (2, 2))
    )
    return np.column_stack((A, random.uniform(-14.0, 14.0, 2)))


def _on_edge(surface: FloatArray, places: FloatArray) -> FloatArray:
    """Return places (N, 2) moved onto the edge through the middle of a surface of two halves."""
    v, u = np.gradient(surface, axis=0), np.gradient(surface, axis=1)
    middle = len(surface) // 2
    near = slice(middle - 8, middle + 9)
    normal = np.array([np.sum(np.asarray(part)[near, near]) for part in (u, v)])
    normal /= np.linalg.norm(normal)
    return np.asarray(places - np.outer(places @ normal, normal))
