"""How well features, camera and arm suit each other: the tools of [Nelson1995] section 2.2."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray


class CameraDirections(NamedTuple):
    """The camera motions in order of how far they move the features."""

    eigenvalues: FloatArray  # (i,) of Bᵀ B, largest first: (px a unit of motion)²
    directions: FloatArray  # (i, i) unit eigenvectors as columns; the axes are those of B's columns
    condition: float  # √(largest / smallest eigenvalue), inf where a motion moves nothing


class Resolvability(NamedTuple):
    """How finely an arm and its camera resolve motion in the image, [NelsonKhosla1994]."""

    singular_values: FloatArray  # (r,) of the image Jacobian, largest first, px a unit of joint
    image_axes: FloatArray  # (2M, r) principal axes of the ellipsoid, as columns
    joint_directions: FloatArray  # (n, r) joint motions of unit size that reach them, as columns


def camera_directions(B: FloatArray) -> CameraDirections:
    """Return the eigenvalues and eigenvectors of Bᵀ B.

    Along a direction with a large eigenvalue camera motion moves the features far, and so makes up
    for the object's motion easily: a good axis to track with. Metres and radians are weighed one
    to one; scale B's columns to weigh them otherwise.

    Args:
        B: image motion for camera motion along each controlled axis, (2M, i).
    """
    eigenvalues, directions = np.linalg.eigh(B.T @ B)
    eigenvalues, directions = np.maximum(eigenvalues[::-1], 0.0), directions[:, ::-1]
    least, most = eigenvalues[-1], eigenvalues[0]
    negligible = least <= len(eigenvalues) * np.finfo(float).eps * most
    return CameraDirections(
        eigenvalues, directions, float("inf") if negligible else float(np.sqrt(most / least))
    )


def gain_matrix(B: FloatArray, Q: FloatArray, R: FloatArray) -> FloatArray:
    """Return (Bᵀ Q B + R)⁻¹ Bᵀ Q (i, 2M), [Nelson1995] eq. (18).

    Args:
        B: (2M, i).
        Q: weights on the feature errors, (2M, 2M), positive semi-definite.
        R: weights on the controlled axes, (i, i), positive definite.
    """
    return np.asarray(np.linalg.solve(B.T @ Q @ B + R, B.T @ Q), dtype=np.float64)


def has_full_rank(B: FloatArray, Q: FloatArray, R: FloatArray, tolerance: float = 1e-9) -> bool:
    """Tell whether (18) has full rank: every controlled axis answers to some feature error.

    It lacks rank where the features are too few, or lie so that a camera motion does not move them.

    Args:
        B: (2M, i).
        Q: (2M, 2M).
        R: (i, i).
        tolerance: singular values below this share of the largest count as zero.
    """
    gain = gain_matrix(B, Q, R)
    values = np.linalg.svd(gain, compute_uv=False)
    rank = int(np.sum(values > tolerance * values.max(initial=0.0)))
    return bool(rank == min(gain.shape))


def resolvability(L: FloatArray, J_camera: FloatArray) -> Resolvability:
    """Return the resolvability ellipsoid: what joint motions of unit size do in the image.

    It is the ellipsoid of the image Jacobian L J, [NelsonKhosla1994]: a feature motion along a long
    axis is resolved finely, one along a short axis needs much joint motion to be seen or undone.

    Args:
        L: interaction matrix of the features, (2M, 6), times the focal length for pixels.
        J_camera: Jacobian of the camera in its own frame, (6, n).
    """
    axes, values, directions = np.linalg.svd(L @ J_camera, full_matrices=False)
    return Resolvability(values, axes, directions.T)
