"""The planner of [Mezouar2001]: a potential field over scaled camera poses, as kernels.

Sections 2 and 3, with these corrections and choices:

- Υ = (t_d, uθ) of the camera in the goal frame; L_w⁻¹ is the right Jacobian of SO(3), which has a
  minus before its first-order term (the printed plus gives ω along the axes of F*).
- After (6) the joints are corrected to the pose of Υ, so that linearisation causes no drift.
- V_rq is available as printed, see `printed_joint_barrier`. By default it uses joint positions
  normalised to [-1, 1] and is a C¹ barrier, like V_rs: half the square of the amount by which the
  printed 1/((1 - q)(1 + q)) exceeds its value at the border of the free zone.
- V_rs = ½ Σ (1/w - 1)², w the distance to a side of the image over the width of its zone, w < 1.
- A zone that contains the goal shrinks to the goal's own clearance.
- The step is clipped at the goal, and halved when the force reverses.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.features import interaction_matrix_points
from vergence.geometry import se3, se3_compose, se3_inverse, se3_log, so3_exp, so3_left_jacobian
from vergence.robot import Chain, forward_kinematics, jacobian

ARRIVED, STUCK, UNFINISHED = 0, 1, 2
NEAREST = 0.02  # relative to a zone: where the barriers stop growing, so that forces remain finite


class Field(NamedTuple):
    """The potential field; all lengths except d* and those of the joints are in units of d*."""

    m_star: FloatArray  # (N, 2) the points in the goal image
    normal: FloatArray  # (3,) n*
    delta: FloatArray  # (N,) distance to the reference plane over Z*
    distance: float  # d*, m
    T_world_star: FloatArray  # (4, 4)
    bounds: FloatArray  # (4,) of the image: x_min, x_max, y_min, y_max
    image_zone: FloatArray  # (4,) width of the zone along each side
    q_min: FloatArray  # (n,)
    q_max: FloatArray  # (n,)
    joint_zone: FloatArray  # (n,) width of the zone at both limits, relative to half the range
    gain_image: float  # γ
    gain_joint: float  # χ
    printed: bool  # V_rq as the paper prints it


class FieldPath(NamedTuple):
    """The result of the descent."""

    upsilon: FloatArray  # (K, 6)
    q: FloatArray  # (K, n)
    m: FloatArray  # (K, N, 2) normalized image points
    rho: FloatArray  # (K, N) Z/d*
    end: int  # ARRIVED, STUCK or UNFINISHED


@njit(cache=True)
def parameter_jacobian(upsilon: FloatArray, distance: float) -> FloatArray:
    """Return M_Υ (6, 6): v_camera = M_Υ dΥ/dt, from *R_c = exp(uθ) and *t_c = d* t_d."""
    M = np.zeros((6, 6))
    M[:3, :3] = distance * so3_exp(upsilon[3:]).T
    M[3:, 3:] = so3_left_jacobian(-upsilon[3:])
    return M


@njit(cache=True)
def image_at(field: Field, upsilon: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the image points (N, 2) and ρ (N,) at Υ: μ m = H m* + δ *Rᵀ t_d, eqs. (7) to (9)."""
    R = so3_exp(upsilon[3:])
    m, rho = np.empty_like(field.m_star), np.empty(len(field.m_star))
    for j in range(len(m)):
        x, y = field.m_star[j, 0], field.m_star[j, 1]
        # H m* + δ *Rᵀ t_d = *Rᵀ (m* - t_d / ρ*), since 1/ρ* = n*·m* - δ.
        inverse = field.normal[0] * x + field.normal[1] * y + field.normal[2] - field.delta[j]
        d0 = x - upsilon[0] * inverse
        d1 = y - upsilon[1] * inverse
        d2 = 1.0 - upsilon[2] * inverse
        mu = R[0, 2] * d0 + R[1, 2] * d1 + R[2, 2] * d2
        rho[j] = mu / inverse
        mu = mu if mu > 1e-3 else 1e-3  # behind the camera: keep the force finite
        m[j, 0] = (R[0, 0] * d0 + R[1, 0] * d1 + R[2, 0] * d2) / mu
        m[j, 1] = (R[0, 1] * d0 + R[1, 1] * d1 + R[2, 1] * d2) / mu
    return m, rho


@njit(cache=True)
def image_barrier(field: Field, m: FloatArray) -> tuple[float, FloatArray]:
    """Return V_rs and its gradient by the image points, (2N,)."""
    value, gradient = 0.0, np.zeros(2 * len(m))
    for j in range(len(m)):
        for side in range(4):
            axis, sign = side // 2, 1.0 - 2.0 * (side % 2)
            zone = field.image_zone[side]
            w = max(sign * (m[j, axis] - field.bounds[side]) / zone, NEAREST)
            if w < 1.0:
                value += 0.5 * (1.0 / w - 1.0) ** 2
                gradient[2 * j + axis] -= sign * (1.0 / w - 1.0) / (w * w * zone)
    return value, gradient


@njit(cache=True)
def joint_barrier(field: Field, q: FloatArray) -> tuple[float, FloatArray]:
    """Return V_rq and its gradient, (n,): ½ Σ (φ - φ₀)² with φ = 1/((1 - q̄)(1 + q̄))."""
    value, gradient = 0.0, np.zeros(len(q))
    for i in range(len(q)):
        half = 0.5 * (field.q_max[i] - field.q_min[i])
        if not np.isfinite(half):
            continue
        place = (q[i] - field.q_min[i]) / half - 1.0
        border, size = 1.0 - field.joint_zone[i], min(abs(place), 1.0 - 0.01 * field.joint_zone[i])
        if size > border:
            excess = 1.0 / (1.0 - size * size) - 1.0 / (1.0 - border * border)
            value += 0.5 * excess * excess
            slope = excess * 2.0 * size / (1.0 - size * size) ** 2
            gradient[i] = np.sign(place) * slope / half
    return value, gradient


@njit(cache=True)
def printed_joint_barrier(field: Field, q: FloatArray) -> tuple[float, FloatArray]:
    """Return V_rq as printed in section 3.6 and its gradient, (n,).

    Σ 1/((1 - q/q_max)(1 - q/q_min)) over all joints once any is in its zone, else 0: it jumps.
    """
    value, gradient, acceptable = 0.0, np.zeros(len(q)), True
    for i in range(len(q)):
        low, high = field.q_min[i], field.q_max[i]
        if not (np.isfinite(low) and np.isfinite(high)):
            continue
        half = 0.5 * (high - low)
        if abs((q[i] - low) / half - 1.0) > 1.0 - field.joint_zone[i]:
            acceptable = False
        edge = 0.01 * field.joint_zone[i] * half  # where the barrier stops growing
        at = min(max(q[i], low + edge), high - edge)
        over, under = 1.0 - at / high, 1.0 - at / low
        value += 1.0 / (over * under)
        gradient[i] = (under / high + over / low) / (over * under) ** 2
    if acceptable:
        return 0.0, np.zeros(len(q))
    return value, gradient


@njit(cache=True)
def damped_solve(J: FloatArray, twist: FloatArray) -> FloatArray:
    """Return J⁺ twist, slightly damped so that it remains bounded at a singularity."""
    A = J @ J.T
    for i in range(6):
        A[i, i] += 1e-8
    return J.T @ np.linalg.solve(A, twist)


@njit(cache=True)
def repulsion(
    field: Field, chain: Chain, upsilon: FloatArray, q: FloatArray, m: FloatArray, rho: FloatArray
) -> FloatArray:
    """Return -γ ∂V_rs/∂Υ - χ ∂V_rq/∂Υ, (6,), section 3.6."""
    force, M = np.zeros(6), parameter_jacobian(upsilon, field.distance)
    if field.gain_image > 0.0:
        value, slope = image_barrier(field, m)
        if value > 0.0:
            depth = field.distance * np.maximum(rho, 1e-3)
            force -= field.gain_image * (M.T @ (interaction_matrix_points(m, depth).T @ slope))
    if field.gain_joint > 0.0:
        if field.printed:
            value, slope = printed_joint_barrier(field, q)
        else:
            value, slope = joint_barrier(field, q)
        if value > 0.0:
            J = jacobian(chain, q)
            A = J @ J.T
            for i in range(6):
                A[i, i] += 1e-8
            force -= field.gain_joint * (M.T @ np.linalg.solve(A, J @ slope))
    return force


@njit(cache=True)
def follow(
    field: Field, chain: Chain, q: FloatArray, before: FloatArray, after: FloatArray
) -> FloatArray:
    """Return the joints after a step of Υ: eq. (6), then one Newton step towards the pose of Υ."""
    twist = parameter_jacobian(before, field.distance) @ (after - before)
    q = q + damped_solve(jacobian(chain, q), twist)
    T_star = se3(so3_exp(after[3:]), field.distance * after[:3])
    T_world = se3_compose(field.T_world_star, T_star)
    missing = se3_log(se3_compose(se3_inverse(forward_kinematics(chain, q)), T_world))
    return q + damped_solve(jacobian(chain, q), missing)


@njit(cache=True)
def descend(
    field: Field, chain: Chain, upsilon: FloatArray, q: FloatArray, step: float, steps_max: int
) -> FieldPath:
    """Descend the potential from Υ to 0: Υ ← Υ + ε F/‖F‖, eq. (1).

    Args:
        field: potentials and object.
        chain: the arm up to the camera.
        upsilon: Υ at the start, (6,).
        q: joint positions at the start, (n,).
        step: ε, in units of Υ.
        steps_max: largest number of steps.
    """
    count = len(field.m_star)
    upsilons, joints = np.empty((steps_max + 1, 6)), np.empty((steps_max + 1, len(q)))
    images, ratios = np.empty((steps_max + 1, count, 2)), np.empty((steps_max + 1, count))
    before, epsilon, k, end = np.zeros(6), step, 0, UNFINISHED
    upsilons[0], joints[0] = upsilon, q
    images[0], ratios[0] = image_at(field, upsilon)
    while k < steps_max:
        force = repulsion(field, chain, upsilons[k], joints[k], images[k], ratios[k]) - upsilons[k]
        size = np.sqrt(np.sum(force**2))
        distance = np.sqrt(np.sum(upsilons[k] ** 2))
        if distance < 1e-9:
            end = ARRIVED
            break
        if size < 1e-9 or epsilon < 1e-4 * step:
            end = STUCK
            break
        direction = force / size
        if np.sum(before**2) > 0.0:  # half of the last direction: the force alone oscillates
            direction = 0.5 * (direction + before)
            direction /= max(np.sqrt(np.sum(direction**2)), 1e-12)
        if np.sum(force * before) < 0.0:
            epsilon *= 0.5
        else:
            epsilon = min(1.2 * epsilon, step)
        before = direction
        if distance <= epsilon and np.sum(direction * upsilons[k]) < -0.5 * distance:
            upsilons[k + 1] = 0.0
        else:
            upsilons[k + 1] = upsilons[k] + min(epsilon, distance) * direction
        joints[k + 1] = follow(field, chain, joints[k], upsilons[k], upsilons[k + 1])
        images[k + 1], ratios[k + 1] = image_at(field, upsilons[k + 1])
        k += 1
    k += 1
    return FieldPath(upsilons[:k], joints[:k], images[:k], ratios[:k], end)
