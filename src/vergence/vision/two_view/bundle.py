"""Bundle adjustment over two views, for three nested models of the object.

One prediction serves all models: a point with normalized coordinates x* in the desired view appears
in the current one at π(R [x*; 1] + w t), w = 1/Z*.

| model | w | pose unknowns | unknowns per point |
|---|---|---|---|
| ROTATION | 0: no translation, or everything at infinity | ω (3) | x* (2) |
| PLANE | n·[x*; 1]: t is in units of the plane's distance | ω, t, n on the sphere (8) | x* (2) |
| GENERAL | free, with ‖t‖ = 1 | ω, t on the sphere (5) | x*, w (3) |
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.geometry import skew, so3_exp
from vergence.vision.two_view.sampson import tangent_basis
from vergence.vision.two_view.small import (
    apply,
    cholesky_inverse,
    cholesky_solve,
    dot,
    times,
    transposed_apply,
    transposed_times,
    unit,
)

ROTATION, PLANE, GENERAL = 0, 1, 2


class TwoViewState(NamedTuple):
    """The variables of two-view bundle adjustment."""

    R: FloatArray  # (3, 3) rotation of X = R X* + t
    t: FloatArray  # (3,) translation in the units of the model
    n: FloatArray  # (3,) unit normal of the plane, in the desired view
    x_star: FloatArray  # (N, 2) normalized coordinates in the desired view
    w: FloatArray  # (N,) inverse depths in the desired view


class NormalBlocks(NamedTuple):
    """The blocks of the normal equations: poses and points."""

    U: FloatArray  # (P, P)
    W: FloatArray  # (N, P, D)
    V: FloatArray  # (N, D, D)
    g: FloatArray  # (P,) pose part of the gradient
    h: FloatArray  # (N, D) points' part of the gradient


@njit(cache=True)
def bundle_sizes(model: int) -> tuple[int, int]:
    """Return the number of pose unknowns and of unknowns per point."""
    if model == ROTATION:
        return 3, 2
    if model == PLANE:
        return 8, 2
    return 5, 3


@njit(cache=True)
def point_in_current(model: int, state: TwoViewState, j: int) -> FloatArray:
    """Return R [x*; 1] + w t of point j, (3,): its position in the current frame, over Z*."""
    ray = np.array([state.x_star[j, 0], state.x_star[j, 1], 1.0])
    if model == ROTATION:
        return apply(state.R, ray)
    w = dot(state.n, ray) if model == PLANE else state.w[j]
    return apply(state.R, ray) + w * state.t


@njit(cache=True)
def bundle_residuals(
    model: int, state: TwoViewState, m_star: FloatArray, m: FloatArray, weight: FloatArray
) -> FloatArray:
    """Return predicted − measured, (N, 4): desired view then current view, times the weights.

    Args:
        model: ROTATION, PLANE or GENERAL.
        state: determines the predictions.
        m_star: measured in the desired view, normalized, (N, 2).
        m: measured in the current view, (N, 2).
        weight: focal length over the noise's standard deviation along x and y, (2,).
    """
    residuals = np.empty((len(m), 4))
    for j in range(len(m)):
        X = point_in_current(model, state, j)
        depth = X[2] if abs(X[2]) > 1e-9 else 1e-9
        for axis in range(2):
            residuals[j, axis] = weight[axis] * (state.x_star[j, axis] - m_star[j, axis])
            residuals[j, 2 + axis] = weight[axis] * (X[axis] / depth - m[j, axis])
    return residuals


@njit(cache=True)
def bundle_jacobian(
    model: int, state: TwoViewState, j: int, weight: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the derivative of point j's four residuals by the pose (4, P) and the point (4, D)."""
    pose_size, point_size = bundle_sizes(model)
    ray = np.array([state.x_star[j, 0], state.x_star[j, 1], 1.0])
    X = point_in_current(model, state, j)
    depth = X[2] if abs(X[2]) > 1e-9 else 1e-9
    dX_pose, dX_point = np.zeros((3, pose_size)), np.zeros((3, point_size))
    dX_pose[:, :3] = -skew(apply(state.R, ray))
    dX_point[:, :2] = state.R[:, :2]
    if model == PLANE:
        basis = tangent_basis(state.n)
        for i in range(3):
            dX_pose[i, 3 + i] = dot(state.n, ray)
            for k in range(2):
                dX_pose[i, 6 + k] = state.t[i] * dot(basis[:, k], ray)
                dX_point[i, k] += state.t[i] * state.n[k]
    elif model == GENERAL:
        dX_pose[:, 3:5] = state.w[j] * tangent_basis(state.t)
        dX_point[:, 2] = state.t
    projection = np.zeros((2, 3))
    for axis in range(2):
        projection[axis, axis] = weight[axis] / depth
        projection[axis, 2] = -weight[axis] * X[axis] / (depth * depth)
    J_pose, J_point = np.zeros((4, pose_size)), np.zeros((4, point_size))
    J_point[0, 0], J_point[1, 1] = weight[0], weight[1]
    J_pose[2:] = times(projection, dX_pose)
    J_point[2:] = times(projection, dX_point)
    return J_pose, J_point


@njit(cache=True)
def normal_blocks(
    model: int, state: TwoViewState, residuals: FloatArray, weight: FloatArray
) -> NormalBlocks:
    """Return JᵀJ and Jᵀr in blocks."""
    pose_size, point_size = bundle_sizes(model)
    count = len(residuals)
    U, g = np.zeros((pose_size, pose_size)), np.zeros(pose_size)
    W = np.empty((count, pose_size, point_size))
    V, h = np.empty((count, point_size, point_size)), np.empty((count, point_size))
    for j in range(count):
        A, B = bundle_jacobian(model, state, j, weight)
        U += transposed_times(A, A)
        g += transposed_apply(A, residuals[j])
        W[j], V[j] = transposed_times(A, B), transposed_times(B, B)
        h[j] = transposed_apply(B, residuals[j])
    return NormalBlocks(U, W, V, g, h)


@njit(cache=True)
def eliminate_points(blocks: NormalBlocks, damping: float) -> tuple[FloatArray, FloatArray]:
    """Solve the damped normal equations by the Schur complement; return pose and point steps."""
    S, g = blocks.U.copy(), blocks.g.copy()
    for k in range(len(g)):
        S[k, k] += damping * blocks.U[k, k] + 1e-9
    inverses = np.empty_like(blocks.V)
    for j in range(len(blocks.V)):
        V = blocks.V[j].copy()
        for k in range(len(V)):
            V[k, k] += damping * V[k, k] + 1e-9
        inverses[j] = cholesky_inverse(V)
        Y = times(blocks.W[j], inverses[j])
        S -= times(Y, blocks.W[j].T)
        g -= apply(Y, blocks.h[j])
    pose = -cholesky_solve(S, g.reshape(len(g), 1))[:, 0]
    points = np.empty_like(blocks.h)
    for j in range(len(points)):
        points[j] = -apply(inverses[j], blocks.h[j] + transposed_apply(blocks.W[j], pose))
    return pose, points


@njit(cache=True)
def moved(model: int, state: TwoViewState, pose: FloatArray, points: FloatArray) -> TwoViewState:
    """Return the state after a step: R ← exp(ω) R, directions along their tangents."""
    t, n, w = state.t, state.n, state.w
    if model == PLANE:
        t = t + pose[3:6]
        n = unit(n + apply(tangent_basis(n), pose[6:8]))
    elif model == GENERAL:
        t = unit(t + apply(tangent_basis(t), pose[3:5]))
        w = w + points[:, 2]
    R = times(so3_exp(pose[:3]), state.R)
    return TwoViewState(R, t, n, state.x_star + points[:, :2], w)


@njit(cache=True)
def adjust_bundle(
    model: int,
    state: TwoViewState,
    m_star: FloatArray,
    m: FloatArray,
    weight: FloatArray,
    iterations: int,
) -> tuple[TwoViewState, FloatArray]:
    """Minimise the weighted reprojection error in both views (Levenberg-Marquardt).

    Returns:
        The state at the minimum and its residuals (N, 4), whose sum of squares is a χ².
    """
    residuals = bundle_residuals(model, state, m_star, m, weight)
    cost, damping = np.sum(residuals**2), 1e-4
    for _ in range(iterations):
        pose, points = eliminate_points(normal_blocks(model, state, residuals, weight), damping)
        candidate = moved(model, state, pose, points)
        residuals_new = bundle_residuals(model, candidate, m_star, m, weight)
        cost_new = np.sum(residuals_new**2)
        if cost_new < cost:
            gained = cost - cost_new
            state, residuals, cost = candidate, residuals_new, cost_new
            damping *= 0.1
            if gained < 1e-6 * cost + 1e-16:
                break
        else:
            damping *= 10.0
            if damping > 1e10:
                break
    return state, residuals
