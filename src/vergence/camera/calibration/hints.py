"""What would make images and arm poses agree, where they do not: the mistakes people make."""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.hand_eye import agree, closed_form
from vergence.camera.calibration.sighting import Sighting
from vergence.geometry import (
    matrix_to_quaternion,
    quaternion_to_matrix,
    se3,
    se3_inverse,
)

_MUCH_BETTER = 0.34  # of the residual as given
_TOLERABLE_PX = 5.0  # what would have to be left


class _Guess(NamedTuple):
    words: str
    A: FloatArray  # (N, 4, 4)
    scale: float = 1.0  # of the board


def hint(
    sightings: Sequence[Sequence[Sighting]],
    A: FloatArray,
    T: FloatArray,
    lens: FloatArray,
    width: int,
    fixed: bool,
    rng: np.random.Generator,
) -> str:
    """Return which mistake would explain that images and poses disagree; empty if none does.

    The arguments are those of `agree`, and whether the camera is fixed.
    """
    given = float(np.median(agree(sightings, A, T, lens, width, rng).residual_px))
    for guess in _guesses(A, T[:, 0], fixed):
        scaled = T.copy()
        scaled[:, :, :3, 3] *= guess.scale
        boards = [[s._replace(points=guess.scale * s.points) for s in each] for each in sightings]
        found = agree(boards, guess.A, scaled, lens, width, rng).residual_px
        left = float(np.median(found))
        if left < min(_MUCH_BETTER * given, _TOLERABLE_PX):
            return f"they would agree within {left:.2g} px {guess.words}"
    return ""


def _guesses(A: FloatArray, T: FloatArray, fixed: bool) -> Iterator[_Guess]:
    back = np.array([se3_inverse(a) for a in A])
    other = "if the camera were mounted the other way, on the arm or fixed (see --fixed), or the "
    yield _Guess(other + "poses were those of the base in the flange", back)
    scale = _scale(A, T)
    if 0.2 < scale < 5.0:
        words = f"if the squares were {100 * scale:.1f} % of the size given"
        yield _Guess(words, A, scale)
    recorded = A if fixed else back
    read = np.array([_scalar_last(pose) for pose in recorded])
    right = read if fixed else np.array([se3_inverse(pose) for pose in read])
    yield _Guess("if the quaternions were in the order x, y, z, w", right)


def _scalar_last(T: FloatArray) -> FloatArray:
    """Return a pose as if its quaternion had been written x, y, z, w and read w, x, y, z."""
    x, y, z, w = matrix_to_quaternion(np.ascontiguousarray(T[:3, :3]))
    turned: FloatArray = se3(quaternion_to_matrix(np.array([w, x, y, z])), T[:3, 3].copy())
    return turned


def _scale(A: FloatArray, T: FloatArray) -> float:
    """Return by what the board's size has to be multiplied to suit the arm's ways.

    As in `closed_form`, with the size as one more unknown: (R_a - 1) t - s R t_b = -t_a.
    """
    R = closed_form(A, T).X[:3, :3]
    left, right = [], []
    for i, j in combinations(range(len(A)), 2):
        a, b = A[j] @ se3_inverse(A[i]), T[j] @ se3_inverse(T[i])
        left.append(np.column_stack((a[:3, :3] - np.eye(3), -R @ b[:3, 3])))
        right.append(-a[:3, 3])
    unknowns = np.linalg.lstsq(np.vstack(left), np.concatenate(right), rcond=None)[0]
    return float(unknowns[3])
