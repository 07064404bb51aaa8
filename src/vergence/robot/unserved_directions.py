"""Which of the six directions of its tip an arm with few joints cannot move in."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray

_DIRECTIONS = (*(f"move along {axis}" for axis in "xyz"), *(f"turn about {axis}" for axis in "xyz"))
_ALL, _SOME = 0.98, 0.02  # fractions of a direction that lie in the unserved subspace
_ZERO = 1e-6  # relative to the largest singular value


class UnservedDirections(NamedTuple):
    """Directions in which the tip cannot move at one configuration; false if there are none."""

    impossible: tuple[str, ...]  # directions in which no joint motion moves the tip
    tied: tuple[str, ...]  # directions possible only in combination with others

    def __bool__(self) -> bool:
        return bool(self.impossible or self.tied)

    def __str__(self) -> str:
        words = [f"cannot {listed(self.impossible, 'or')}"] if self.impossible else []
        if self.tied:
            words.append(f"can {listed(self.tied, 'and')} only in combination")
        return " and ".join(words)


def unserved_directions(J: FloatArray, length_m: float) -> UnservedDirections:
    """Return the directions that the columns of a Jacobian do not span.

    They are the null space of Jᵀ, with translations scaled by a length so that they compare with
    rotations.

    Args:
        J: (6, n) of the tip in its own frame.
        length_m: such as the distance from the camera to the target.
    """
    scale = np.repeat((1.0 / length_m, 1.0), 3)
    U, values, _ = np.linalg.svd(scale[:, None] * J)
    rank = np.count_nonzero(values > _ZERO * max(values.max(initial=0.0), 1e-12))
    return _named(U[:, rank:])


def unmeasured_directions(H: FloatArray, length_m: float) -> UnservedDirections:
    """Return the directions of a twist that leave a quadratic form ½ vᵀ H v unchanged.

    Args:
        H: (6, 6), positive semi-definite.
        length_m: as for `unserved_directions`.
    """
    scale = np.repeat((length_m, 1.0), 3)
    values, vectors = np.linalg.eigh(scale[:, None] * H * scale)
    return _named(vectors[:, values <= _ZERO**2 * max(float(values[-1]), 1e-12)])


def _named(basis: FloatArray) -> UnservedDirections:
    """Name the directions of an orthonormal basis (6, k)."""
    share = np.sum(basis**2, axis=1)
    named = list(zip(_DIRECTIONS, share.tolist(), strict=True))
    return UnservedDirections(
        tuple(name for name, part in named if part > _ALL),
        tuple(name for name, part in named if _SOME < part <= _ALL),
    )


def listed(names: tuple[str, ...], word: str) -> str:
    """Return names as a list in a sentence, with a word such as "and" before the last one."""
    *first, last = names
    return f"{', '.join(first)} {word} {last}" if first else last
