"""Hand and eye in closed form, and which images agree on it.

One equation holds for a camera on the arm and for one that looks at the end effector:

    T_camera_board = X⁻¹ A Y

with A the arm's pose as recorded. On the arm, X = T_flange_camera, A = T_flange_base and
Y = T_base_board; fixed, X = T_base_camera, A = T_base_flange and Y = T_flange_board.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.camera.calibration.reprojection import residuals, rms
from vergence.camera.calibration.sighting import Sighting
from vergence.geometry import nearest_rotation, se3, se3_inverse, so3_log

_SUBSETS = 150  # of three images, tried for the start
TOLERATED = 0.08  # of the image's width: farther off, an image counts as contradicting
_HALF_TURN = np.deg2rad(170.0)  # beyond, the sign of a rotation vector is not to be trusted


class Mounting(NamedTuple):
    """Where camera and board are fixed."""

    X: FloatArray  # (4, 4) the camera, in the flange or in the arm's base
    Y: FloatArray  # (4, 4) the board, in the arm's base or in the flange

    def T_camera_board(self, A: FloatArray) -> FloatArray:
        """Return the board's pose (4, 4) in the camera for one A, or (N, 4, 4) for many."""
        T: FloatArray = se3_inverse(self.X) @ A @ self.Y
        return T


class Agreement(NamedTuple):
    """A mounting on which most images agree."""

    mounting: Mounting
    turns: IntArray  # (N,) which of the board's possible orientations each image shows
    residual_px: FloatArray  # (N,) rms of each image under it


def turning_deg(A: FloatArray) -> FloatArray:
    """Return how far the arm turned between poses (N, 4, 4) about three axes, largest first, deg.

    The root mean square over all pairs, about the axes in which it is largest and smallest.
    """
    pairs = [so3_log(A[j, :3, :3] @ A[i, :3, :3].T) for i, j in combinations(range(len(A)), 2)]
    spread = np.mean([np.outer(w, w) for w in pairs], axis=0) if pairs else np.zeros((3, 3))
    angles: FloatArray = np.sqrt(np.maximum(np.linalg.eigvalsh(spread)[::-1], 0.0))
    return np.asarray(np.rad2deg(angles))


def closed_form(A: FloatArray, T: FloatArray) -> Mounting:
    """Return the mounting of arm poses A (N, 4, 4) and board poses T (N, 4, 4) in the camera.

    Between two images (A_j A_i⁻¹) X = X (T_j T_i⁻¹): the rotation from the rotation vectors, the
    position then linear, both in the least-squares sense [ParkMartin1994].
    """
    moves = []
    for i, j in combinations(range(len(A)), 2):
        a, b = A[j] @ se3_inverse(A[i]), T[j] @ se3_inverse(T[i])
        w_a, w_b = so3_log(a[:3, :3].copy()), so3_log(b[:3, :3].copy())
        if max(np.linalg.norm(w_a), np.linalg.norm(w_b)) < _HALF_TURN:
            moves.append((a, b, w_a, w_b))
    R = nearest_rotation(sum((np.outer(m[2], m[3]) for m in moves), np.zeros((3, 3))))
    left = np.vstack([np.zeros((1, 3)), *(a[:3, :3] - np.eye(3) for a, *_ in moves)])
    right = np.concatenate([np.zeros(1), *(R @ b[:3, 3] - a[:3, 3] for a, b, *_ in moves)])
    X = se3(R, np.ascontiguousarray(np.linalg.lstsq(left, right, rcond=None)[0]))
    return Mounting(X, board_in_mount(A, T, X))


def board_in_mount(A: FloatArray, T: FloatArray, X: FloatArray) -> FloatArray:
    """Return Y (4, 4) for a camera at X: the mean over arm poses A and board poses T, (N, 4, 4)."""
    boards = np.array([se3_inverse(a) @ X @ t for a, t in zip(A, T, strict=True)])
    Y: FloatArray = se3(
        nearest_rotation(boards[:, :3, :3].mean(axis=0)), boards[:, :3, 3].mean(axis=0)
    )
    return Y


def agree(
    sightings: Sequence[Sequence[Sighting]],
    A: FloatArray,
    T: FloatArray,
    lens: FloatArray,
    width: int,
    rng: np.random.Generator,
) -> Agreement:
    """Find the mounting on which most images agree, even if others contradict it.

    Mountings are made of three images each; the one with the least residuals over all, each cut
    off where it counts as contradicting, is made again of all images that agree.

    Args:
        sightings: of each image, one for each orientation that the board may have had in it.
        A: arm poses, (N, 4, 4).
        T: board poses in the camera for these, (N, S, 4, 4).
        lens: parameters, (9,).
        width: of the images, px.
        rng: chooses the triples.
    """
    count, orientations = T.shape[:2]
    cut = TOLERATED * width
    best = None
    for chosen in _threes(count, rng):
        for turns in np.ndindex(1, orientations, orientations):
            some = list(chosen)
            found = _judge(closed_form(A[some], T[some, list(turns)]), sightings, A, lens)
            if best is None or _cost(found, cut) < _cost(best, cut):
                best = found
    assert best is not None
    for _ in range(5):
        inside = np.flatnonzero(best.residual_px < cut)
        if len(inside) < 3:
            break
        again = closed_form(A[inside], T[inside, best.turns[inside]])
        found = _judge(again, sightings, A, lens)
        if _cost(found, cut) >= _cost(best, cut):
            break
        best = found
    return best


def _threes(count: int, rng: np.random.Generator) -> list[tuple[int, ...]]:
    """Return all triples of images, or as many as are tried."""
    if count <= 11:
        return list(combinations(range(count), 3))
    return [tuple(rng.choice(count, 3, replace=False)) for _ in range(_SUBSETS)]


def _judge(
    mounting: Mounting, sightings: Sequence[Sequence[Sighting]], A: FloatArray, lens: FloatArray
) -> Agreement:
    turns, sizes = np.zeros(len(A), dtype=np.int64), np.empty(len(A))
    for n, (T, seen) in enumerate(zip(mounting.T_camera_board(A), sightings, strict=True)):
        T = np.ascontiguousarray(T)
        each = [rms(residuals(lens, T, s)) if T[2, 3] > 0.0 else np.inf for s in seen]
        turns[n] = int(np.argmin(each))
        sizes[n] = each[turns[n]]
    return Agreement(mounting, turns, sizes)


def _cost(found: Agreement, cut: float) -> float:
    return float(np.minimum(np.nan_to_num(found.residual_px, nan=np.inf), cut).sum())
