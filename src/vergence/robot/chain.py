"""A serial chain of joints as arrays, and its kinematics as kernels."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, frozen

Vector = tuple[float, float, float]


UNCOUPLED = frozen(np.empty((0, 3)))  # every axis is a joint of its own


class Chain(NamedTuple):
    """Axes from the world to a tip, each along z of its frame, moved by n ≤ m joints.

    With T_i = [rotation[i], position[i]] fixed and Z_i(s_i) the motion along or about axis i,
    T_world_tip(q) = T_0 Z_0(s_0) T_1 Z_1(s_1) … T_m. Without coupling, m = n and s = q; with it,
    joint j = coupling[i, 0] moves axis i by s_i = coupling[i, 1] q_j + coupling[i, 2].
    """

    rotation: FloatArray  # (m + 1, 3, 3)
    position: FloatArray  # (m + 1, 3) m
    sliding: BoolArray | FloatArray  # (m,) true (or 1) where an axis slides
    coupling: FloatArray = UNCOUPLED  # (m, 3) index of the joint, ratio, offset; or (0, 3)


class ChainState(NamedTuple):
    """Where the chain's axes and its tip are, along world axes."""

    axis: FloatArray  # (m, 3) unit vectors of the axes
    anchor: FloatArray  # (m, 3) a point on each axis, m
    R: FloatArray  # (3, 3) of T_world_tip
    p: FloatArray  # (3,) of T_world_tip, m


@njit(cache=True, error_model="numpy", inline="always")
def axis_position(chain: Chain, q: FloatArray, i: int) -> float:
    """Return how far joint positions q (n,) move axis i, rad or m."""
    if len(chain.coupling) == 0:
        return float(q[i])
    joint, ratio, offset = int(chain.coupling[i, 0]), chain.coupling[i, 1], chain.coupling[i, 2]
    return float(ratio * q[joint] + offset)


@njit(cache=True, error_model="numpy", inline="always")
def joint_columns(chain: Chain, J_axes: FloatArray, joint_count: int) -> FloatArray:
    """Return J (r, n) by joint from J_axes (r, m) by axis: J_j = Σ ratio_i J_axes,i."""
    if len(chain.coupling) == 0:
        return J_axes
    J = np.zeros((J_axes.shape[0], joint_count))
    for i in range(J_axes.shape[1]):
        j, ratio = int(chain.coupling[i, 0]), chain.coupling[i, 1]
        for r in range(len(J)):
            J[r, j] += ratio * J_axes[r, i]
    return J


@njit(cache=True, error_model="numpy")
def along(x: Vector, y: Vector, z: Vector, a: float, b: float, c: float) -> Vector:
    """Return a x + b y + c z; as tuples, the three stay in registers."""
    return (
        a * x[0] + b * y[0] + c * z[0],
        a * x[1] + b * y[1] + c * z[1],
        a * x[2] + b * y[2] + c * z[2],
    )


Axes = tuple[Vector, Vector, Vector, Vector]  # x, y, z of a frame and its origin


@njit(cache=True, error_model="numpy")
def fixed_step(frame: Axes, R: FloatArray, t: FloatArray) -> Axes:
    """Return the next frame of the chain before its joint has moved, R (3, 3) and t (3,) fixed."""
    x, y, z, p = frame
    step = along(x, y, z, t[0], t[1], t[2])
    return (
        along(x, y, z, R[0, 0], R[1, 0], R[2, 0]),
        along(x, y, z, R[0, 1], R[1, 1], R[2, 1]),
        along(x, y, z, R[0, 2], R[1, 2], R[2, 2]),
        (p[0] + step[0], p[1] + step[1], p[2] + step[2]),
    )


@njit(cache=True, error_model="numpy")
def joint_step(frame: Axes, q: float, sliding: bool) -> Axes:
    """Return a frame moved by q about its z axis, or along it."""
    x, y, z, p = frame
    if sliding:
        return x, y, z, (p[0] + q * z[0], p[1] + q * z[1], p[2] + q * z[2])
    c, s = np.cos(q), np.sin(q)
    return along(x, y, z, c, s, 0.0), along(x, y, z, -s, c, 0.0), z, p


@njit(cache=True, error_model="numpy")
def tip_frame(chain: Chain, q: FloatArray) -> Axes:
    """Return the tip's axes and its place along world axes, at joint positions q (n,)."""
    R, t = chain.rotation, chain.position
    frame = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    m = len(chain.sliding)
    for i in range(m):
        frame = joint_step(
            fixed_step(frame, R[i], t[i]), axis_position(chain, q, i), chain.sliding[i]
        )
    return fixed_step(frame, R[m], t[m])


@njit(cache=True, error_model="numpy")
def chain_state(chain: Chain, q: FloatArray) -> ChainState:
    """Walk the chain at joint positions q (n,)."""
    m, R, t = len(chain.sliding), chain.rotation, chain.position
    axis, anchor = np.empty((m, 3)), np.empty((m, 3))
    frame = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    for i in range(m):
        frame = fixed_step(frame, R[i], t[i])
        axis[i, 0], axis[i, 1], axis[i, 2] = frame[2]
        anchor[i, 0], anchor[i, 1], anchor[i, 2] = frame[3]
        frame = joint_step(frame, axis_position(chain, q, i), chain.sliding[i])
    x, y, z, p = fixed_step(frame, R[m], t[m])
    tip_R, tip_p = np.empty((3, 3)), np.empty(3)
    for a in range(3):
        tip_R[a, 0], tip_R[a, 1], tip_R[a, 2], tip_p[a] = x[a], y[a], z[a], p[a]
    return ChainState(axis, anchor, tip_R, tip_p)


@njit(cache=True, error_model="numpy")
def frame_matrix(frame: Axes) -> FloatArray:
    """Return a frame as a pose (4, 4)."""
    T = np.eye(4)
    x, y, z, p = frame
    for a in range(3):
        T[a, 0], T[a, 1], T[a, 2], T[a, 3] = x[a], y[a], z[a], p[a]
    return T


@njit(cache=True, error_model="numpy")
def world_jacobian(chain: Chain, state: ChainState, joint_count: int) -> FloatArray:
    """Return J (6, n) of so many joints: (v, ω) of the tip along world axes = J q̇."""
    J = np.empty((6, len(state.axis)))
    for i in range(len(state.axis)):
        z, o = state.axis[i], state.anchor[i]
        if chain.sliding[i]:
            J[0, i], J[1, i], J[2, i] = z[0], z[1], z[2]
            J[3, i] = J[4, i] = J[5, i] = 0.0
        else:
            x, y, w = state.p[0] - o[0], state.p[1] - o[1], state.p[2] - o[2]
            J[0, i], J[1, i], J[2, i] = (
                z[1] * w - z[2] * y,
                z[2] * x - z[0] * w,
                z[0] * y - z[1] * x,
            )
            J[3, i], J[4, i], J[5, i] = z[0], z[1], z[2]
    return joint_columns(chain, J, joint_count)


@njit(cache=True, error_model="numpy")
def forward_kinematics(chain: Chain, q: FloatArray) -> FloatArray:
    """Return T_world_tip (4, 4) at joint positions q (n,)."""
    T: FloatArray = frame_matrix(tip_frame(chain, q))
    return T


@njit(cache=True, error_model="numpy", inline="always")
def jacobian(chain: Chain, q: FloatArray) -> FloatArray:
    """Return the tip's Jacobian (6, n) in its own frame: v_tip = J q̇, v_camera for a camera."""
    return joint_columns(chain, axis_jacobian(chain, q), len(q))


@njit(cache=True, error_model="numpy", inline="always")
def axis_jacobian(chain: Chain, q: FloatArray) -> FloatArray:
    """Return the tip's Jacobian (6, m) in its own frame by axis, at joint positions q (n,).

    The chain is walked from the tip to the base, every axis z and a point o on it drawn in the
    tip's frame: a turning joint moves the tip by (o × z, z), a sliding one by (z, 0).
    """
    m, T, t = len(chain.sliding), chain.rotation, chain.position
    J = np.empty((6, m))
    x, y, z, o = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    for i in range(m - 1, -1, -1):
        x, y, z = (
            along(x, y, z, T[i + 1, 0, 0], T[i + 1, 0, 1], T[i + 1, 0, 2]),
            along(x, y, z, T[i + 1, 1, 0], T[i + 1, 1, 1], T[i + 1, 1, 2]),
            along(x, y, z, T[i + 1, 2, 0], T[i + 1, 2, 1], T[i + 1, 2, 2]),
        )
        step = along(x, y, z, t[i + 1, 0], t[i + 1, 1], t[i + 1, 2])
        o = (o[0] - step[0], o[1] - step[1], o[2] - step[2])
        s = axis_position(chain, q, i)
        if chain.sliding[i]:
            J[0, i], J[1, i], J[2, i] = z
            J[3, i] = J[4, i] = J[5, i] = 0.0
            o = (o[0] - s * z[0], o[1] - s * z[1], o[2] - s * z[2])
        else:
            J[0, i] = o[1] * z[2] - o[2] * z[1]
            J[1, i] = o[2] * z[0] - o[0] * z[2]
            J[2, i] = o[0] * z[1] - o[1] * z[0]
            J[3, i], J[4, i], J[5, i] = z
            c, d = np.cos(s), np.sin(s)
            x, y = along(x, y, z, c, -d, 0.0), along(x, y, z, d, c, 0.0)
    return J
