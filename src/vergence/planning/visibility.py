"""Constraints that keep points in a camera's view, as kernels: half-spaces and their gradients.

Five half-spaces in the camera frame contain the visible points; one per face of the object, in the
world frame, contains the camera positions that see its front.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.estimation.feature_faces import face_sines
from vergence.robot import Chain, chain_state, world_jacobian


class View(NamedTuple):
    """The space that a camera sees, and the points that must stay in it.

    A point X in the camera frame is visible if h_k = (a_k·X - b_k)/‖X‖ > 0 for every k. For the
    four sides, through the focal point, h is the sine of the angle to the side; it remains smooth
    where pixel coordinates diverge and change sign. The fifth keeps a smallest depth.

    A face with the point c and the outward normal o is visible from p if o·(p - c)/‖p - c‖, the
    sine of the angle at which it is seen, exceeds a threshold.
    """

    normals: FloatArray  # (5, 3) a_k, unit
    offsets: FloatArray  # (5,) b_k, m
    points_world: FloatArray  # (N, 3) m
    faces: FloatArray  # (F, 7) c in m, o, and the smallest sine


NO_FACES = np.empty((0, 7))


def make_view(
    camera: Camera,
    points_world: FloatArray,
    margin_px: float,
    depth_min: float,
    faces: FloatArray = NO_FACES,
) -> View:
    """Return the view of a camera that keeps a margin in pixels and a smallest depth in metres."""
    x_min, x_max, y_min, y_max = camera.rectangle(margin_px)
    sides = np.array([[1, 0, -x_min], [-1, 0, x_max], [0, 1, -y_min], [0, -1, y_max], [0, 0, 1.0]])
    return View(
        sides / np.linalg.norm(sides, axis=1, keepdims=True),
        np.array([0.0, 0.0, 0.0, 0.0, depth_min]),
        np.array(points_world, dtype=np.float64),
        np.array(faces, dtype=np.float64),
    )


@njit(cache=True)
def view_clearances(R: FloatArray, p: FloatArray, view: View) -> FloatArray:
    """Return h of every point and side, (N, 5), from the camera's pose R, p in the world."""
    h = np.empty((len(view.points_world), 5))
    for j in range(len(h)):
        d0 = view.points_world[j, 0] - p[0]
        d1 = view.points_world[j, 1] - p[1]
        d2 = view.points_world[j, 2] - p[2]
        x = R[0, 0] * d0 + R[1, 0] * d1 + R[2, 0] * d2
        y = R[0, 1] * d0 + R[1, 1] * d1 + R[2, 1] * d2
        z = R[0, 2] * d0 + R[1, 2] * d1 + R[2, 2] * d2
        norm = np.sqrt(x * x + y * y + z * z) + 1e-12
        for k in range(5):
            a = view.normals[k]
            h[j, k] = (a[0] * x + a[1] * y + a[2] * z - view.offsets[k]) / norm
    return h


@njit(cache=True)
def face_clearances(p: FloatArray, faces: FloatArray) -> FloatArray:
    """Return the sine at which each face is seen from p (3,), minus its smallest one, (F,)."""
    h: FloatArray = face_sines(p, faces) - faces[:, 6]
    return h


@njit(cache=True)
def clearance_at(chain: Chain, q: FloatArray, view: View) -> float:
    """Return the smallest h over all points, sides and faces at joint positions q."""
    state = chain_state(chain, q)
    least: float = view_clearances(state.R, state.p, view).min()
    if len(view.faces):
        least = min(least, face_clearances(state.p, view.faces).min())
    return least


@njit(cache=True)
def add_visibility_penalty(
    chain: Chain,
    q: FloatArray,
    view: View,
    margin: float,
    weight: float,
    gradient: FloatArray,
    hessian: FloatArray,
) -> float:
    """Return weight/2 Σ max(0, margin - h)²; add its gradient (n,) and Gauss-Newton matrix (n, n).

    With x̂ = X/‖X‖ and c = (a - h x̂)/‖X‖ along world axes, the point moves against the camera, so
    ∂h/∂q = -(c·J_v + ((P - p) × c)·J_ω).
    """
    state = chain_state(chain, q)
    h = view_clearances(state.R, state.p, view)
    seen = face_clearances(state.p, view.faces)
    if h.min() >= margin and (len(seen) == 0 or seen.min() >= margin):
        return 0.0
    J = world_jacobian(chain, state, len(q))
    n = len(q)
    cost = _add_face_penalty(state.p, J, view.faces, seen, margin, weight, gradient, hessian)
    slope, c, d = np.empty(n), np.empty(3), np.empty(3)
    for j in range(len(h)):
        for i in range(3):
            d[i] = view.points_world[j, i] - state.p[i]
        norm = np.sqrt(d[0] ** 2 + d[1] ** 2 + d[2] ** 2) + 1e-12
        for k in range(5):
            short = margin - h[j, k]
            if short <= 0.0:
                continue
            a = view.normals[k]
            for i in range(3):
                turned = state.R[i, 0] * a[0] + state.R[i, 1] * a[1] + state.R[i, 2] * a[2]
                c[i] = (turned - h[j, k] * d[i] / norm) / norm
            l0 = d[1] * c[2] - d[2] * c[1]
            l1 = d[2] * c[0] - d[0] * c[2]
            l2 = d[0] * c[1] - d[1] * c[0]
            for i in range(n):
                slope[i] = -(c[0] * J[0, i] + c[1] * J[1, i] + c[2] * J[2, i]) - (
                    l0 * J[3, i] + l1 * J[4, i] + l2 * J[5, i]
                )
            cost += 0.5 * weight * short * short
            for i in range(n):
                gradient[i] -= weight * short * slope[i]
                for r in range(n):
                    hessian[i, r] += weight * slope[i] * slope[r]
    return cost


@njit(cache=True)
def _add_face_penalty(
    p: FloatArray,
    J: FloatArray,
    faces: FloatArray,
    h: FloatArray,
    margin: float,
    weight: float,
    gradient: FloatArray,
    hessian: FloatArray,
) -> float:
    """Return the penalty of the faces: with d = p - c, ∂h/∂p = (o - (o·d̂) d̂)/‖d‖."""
    n, cost = len(gradient), 0.0
    slope, d = np.empty(n), np.empty(3)
    for f in range(len(faces)):
        short = margin - h[f]
        if short <= 0.0:
            continue
        for i in range(3):
            d[i] = p[i] - faces[f, i]
        norm = np.sqrt(d[0] ** 2 + d[1] ** 2 + d[2] ** 2) + 1e-12
        sine = h[f] + faces[f, 6]
        slope[:] = 0.0
        for i in range(3):
            c = (faces[f, 3 + i] - sine * d[i] / norm) / norm
            for r in range(n):
                slope[r] += c * J[i, r]
        cost += 0.5 * weight * short * short
        for i in range(n):
            gradient[i] -= weight * short * slope[i]
            for r in range(n):
                hessian[i, r] += weight * slope[i] * slope[r]
    return cost
