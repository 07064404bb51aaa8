"""Whether an arm can do what a law asks of its camera: found out before anything moves."""

from collections.abc import Callable

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.errors import InputError

_LEAST = 2  # of six axes: laws do what an arm of few joints can, unless they name axes
_TURN = 0.05  # rad or m: near a singular start there are postures that are not
_RANK = 1e-6  # singular values below this share of the largest are none


def require_motion(
    source: str,
    camera: str,
    jacobian: Callable[[FloatArray], FloatArray],
    q: FloatArray,
    L: FloatArray,
    axes: BoolArray,
) -> None:
    """Refuse an arm that cannot move the features, or its camera, as it is asked to.

    Args:
        source: the cell file.
        camera: its name.
        jacobian: of the camera at joint positions (n,): (6, n).
        q: joint positions at the start, (n,).
        L: interaction matrix of the features, (2M, 6); the identity where the pose itself is asked.
        axes: of the camera, that the law is to move, (6,).

    Raises:
        InputError: with how many ways there are and how many are asked.
    """
    rng = np.random.default_rng(0)
    nearby = [q, *(q + _TURN * rng.uniform(-1, 1, (4, len(q))))]
    most = max(_rank(L[:, axes] @ jacobian(posture)[axes]) for posture in nearby)
    asked = min(_LEAST if axes.all() else int(axes.sum()), len(L))
    if most >= asked:
        return
    ways = f"{len(q)} joint{'s' if len(q) > 1 else ''}"
    if most == 0:
        given = f"{camera}, whose arm ({ways}) has no motion that reduces the error"
    else:
        given = f"{camera}, whose arm ({ways}) can change the image in {most} independent ways"
    allowed = (
        f"a camera that can be moved in {asked}, as the law requires, or a law with fewer axes"
    )
    raise InputError(source, "task.camera", given, allowed)


def _rank(E: FloatArray) -> int:
    values = np.linalg.svd(E, compute_uv=False)
    return int(np.sum(values > _RANK * max(1.0, float(values.max(initial=0.0)))))
