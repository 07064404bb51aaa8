"""The covariance of a two-view reconstruction."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray
from vergence.geometry import skew, so3_left_jacobian_inverse, so3_log
from vergence.vision.two_view.bundle import GENERAL, PLANE, NormalBlocks, TwoViewState
from vergence.vision.two_view.sampson import tangent_basis
from vergence.vision.two_view.small import (
    apply,
    cholesky_inverse,
    cholesky_solve,
    dot,
    times,
    transposed_apply,
    transposed_times,
)


@njit(cache=True)
def reference_plane(points: FloatArray) -> FloatArray:
    """Return N = n/d of the plane N·X = 1 that best fits points (K, 3), K ≥ 3."""
    ones = np.ones((len(points), 1))
    return cholesky_solve(transposed_times(points, points), transposed_times(points, ones))[:, 0]


@njit(cache=True)
def points_in_desired(state: TwoViewState, indices: IntArray) -> FloatArray:
    """Return the chosen points (K, 3) in the desired frame, in units of ‖t‖."""
    points = np.empty((len(indices), 3))
    for k in range(len(indices)):
        j = indices[k]
        points[k, 0], points[k, 1], points[k, 2] = state.x_star[j, 0], state.x_star[j, 1], 1.0
        points[k] /= state.w[j]
    return points


@njit(cache=True)
def pose_jacobian(model: int, state: TwoViewState, reference: IntArray) -> FloatArray:
    """Return dΥ by the bundle's unknowns, (6, P + K D), Υ = (t_d, uθ) of [Mezouar2001] section 3.2.

    With *R = Rᵀ and *t = −Rᵀ t:  d(uθ) = −J_l⁻¹(−uθ) dω,  d*t = −Rᵀ [t]× dω − Rᵀ dt; and the
    paper's unit of length is the distance 1/‖N‖ of the reference plane, dN = −M⁺ dM N.

    Args:
        model: PLANE or GENERAL.
        state: at the minimum.
        reference: indices of the points that span the plane, (K,); unused for PLANE.
    """
    Rt = state.R.T.copy()
    rotation = -so3_left_jacobian_inverse(-so3_log(Rt))
    lever = -times(Rt, skew(state.t))
    if model == PLANE:
        J = np.zeros((6, 8))
        J[:3, :3], J[:3, 3:6], J[3:, :3] = lever, -Rt, rotation
        return J
    M = points_in_desired(state, reference)
    N = reference_plane(M)
    inverse_distance = np.sqrt(dot(N, N))
    t_star = -apply(Rt, state.t)
    J = np.zeros((6, 5 + 3 * len(reference)))
    J[:3, :3] = inverse_distance * lever
    J[:3, 3:5] = -inverse_distance * times(Rt, tangent_basis(state.t))
    J[3:, :3] = rotation
    pseudo = cholesky_solve(transposed_times(M, M), M.T)
    for k in range(len(reference)):
        w = state.w[reference[k]]
        dX = np.zeros((3, 3))
        dX[0, 0], dX[1, 1] = 1.0 / w, 1.0 / w
        dX[:, 2] = -M[k] / w
        d_inverse = -dot(N, pseudo[:, k]) / inverse_distance * transposed_apply(dX, N)
        for i in range(3):
            J[i, 5 + 3 * k : 8 + 3 * k] = t_star[i] * d_inverse
    return J


@njit(cache=True)
def bundle_covariance(blocks: NormalBlocks, chosen: IntArray) -> FloatArray:
    """Return the covariance of the pose unknowns and of the chosen points, (P + K D) square.

    It is the inverse of the normal matrix, taken through the Schur complement S of the pose:
    C_pp = S⁻¹, C_pj = −S⁻¹ Y_j, C_ij = δ_ij V_j⁻¹ + Y_iᵀ S⁻¹ Y_j, Y_j = W_j V_j⁻¹.
    """
    S = blocks.U.copy()
    poses, size = len(S), blocks.V.shape[1]
    for j in range(len(blocks.V)):
        S -= times(times(blocks.W[j], cholesky_inverse(blocks.V[j])), blocks.W[j].T)
    C_pose = cholesky_inverse(S)
    total = poses + size * len(chosen)
    C = np.zeros((total, total))
    C[:poses, :poses] = C_pose
    Y = np.empty((poses, total - poses))
    for k in range(len(chosen)):
        V_inverse = cholesky_inverse(blocks.V[chosen[k]])
        at = size * k
        Y[:, at : at + size] = times(blocks.W[chosen[k]], V_inverse)
        C[poses + at : poses + at + size, poses + at : poses + at + size] = V_inverse
    mixed = -times(C_pose, Y)
    C[:poses, poses:], C[poses:, :poses] = mixed, mixed.T
    C[poses:, poses:] -= transposed_times(Y, mixed)
    return C


@njit(cache=True)
def upsilon_covariance(
    model: int, state: TwoViewState, blocks: NormalBlocks, reference: IntArray
) -> FloatArray:
    """Return the covariance of Υ = (t_d, uθ), (6, 6), for unit noise of the weighted residuals."""
    J = pose_jacobian(model, state, reference)
    chosen = reference if model == GENERAL else reference[:0]
    return times(times(J, bundle_covariance(blocks, chosen)), J.T)
