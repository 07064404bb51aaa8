"""What every law comes down to: a quadratic in the camera's twist."""

from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.control.image_motion import FeatureState
from vergence.signals import Reference


class TwistObjective(NamedTuple):
    """Minimise ½ vᵀ H v - gᵀ v over the camera twist v = v_camera."""

    H: FloatArray  # (6, 6) positive semi-definite
    g: FloatArray  # (6,)


class Objective(Protocol):
    """A law without an arm: what the camera should do about the features."""

    def twist_objective(
        self, features: FeatureState, found: BoolArray, depth: FloatArray, reference: Reference
    ) -> TwistObjective:
        """Return the quadratic for this tick.

        Args:
            features: points and flow now, normalized coordinates, (M, 2).
            found: which of them are to be believed, (M,).
            depth: of the features, (M,), m.
            reference: what is wanted.
        """
        ...


def seen_only(
    features: FeatureState, found: BoolArray, depth: FloatArray, reference: Reference
) -> tuple[FeatureState, BoolArray, FloatArray, Reference]:
    """Return the arguments of `twist_objective` without the features that were not found.

    Of those, nobody may know where they are.
    """
    if found.all():
        return features, found, depth, reference

    def seen(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else values[found]

    kept = replace(
        reference,
        points_px=seen(reference.points_px),
        velocity_px=seen(reference.velocity_px),
        depth_m=seen(reference.depth_m),
    )
    state = FeatureState(features.points[found], features.flow[found], depth[found])
    return state, found[found], depth[found], kept


@njit(cache=True, error_model="numpy")
def least_squares_objective(
    E: FloatArray, wanted: FloatArray, weight: FloatArray, R: FloatArray
) -> TwistObjective:
    """Return the quadratic of ‖E v - wanted‖² weighted by rows, plus vᵀ diag(R) v.

    Args:
        E: (m, 6).
        wanted: (m,).
        weight: (m,).
        R: (6,).
    """
    H, g = np.zeros((6, 6)), np.zeros(6)
    for i in range(6):
        for r in range(len(E)):
            g[i] += weight[r] * E[r, i] * wanted[r]
        for j in range(i + 1):
            total = R[i] if i == j else 0.0
            for r in range(len(E)):
                total += weight[r] * E[r, i] * E[r, j]
            H[i, j] = H[j, i] = total
    return TwistObjective(H, g)
