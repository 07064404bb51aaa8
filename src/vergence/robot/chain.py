"""A serial chain of joints as arrays, and its kinematics as kernels."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray

Vector = tuple[float, float, float]


class Chain(NamedTuple):
    """Joints from the world to a tip; every joint moves about or along the z axis of its frame.

    With T_i = [rotation[i], position[i]] fixed and Z_i(q_i) the motion of joint i,
    T_world_tip(q) = T_0 Z_0(q_0) T_1 Z_1(q_1) … T_n.
    """

    rotation: FloatArray  # (n + 1, 3, 3)
    position: FloatArray  # (n + 1, 3) m
    sliding: BoolArray | FloatArray  # (n,) true (or 1) where a joint slides


class ChainState(NamedTuple):
    """Where the chain's axes and its tip are, along world axes."""

    axis: FloatArray  # (n, 3) unit vectors of the joints
    anchor: FloatArray  # (n, 3) a point on each axis, m
    R: FloatArray  # (3, 3) of T_world_tip
    p: FloatArray  # (3,) of T_world_tip, m


@njit(cache=True, error_model="numpy")
def along(x: Vector, y: Vector, z: Vector, a: float, b: float, c: float) -> Vector:
    """Return a x + b y + c z; as tuples, the three stay in registers."""
    return (
        a * x[0] + b * y[0] + c * z[0],
        a * x[1] + b * y[1] + c * z[1],
        a * x[2] + b * y[2] + c * z[2],
    )


@njit(cache=True, error_model="numpy")
def chain_state(chain: Chain, q: FloatArray) -> ChainState:
    """Walk the chain at joint positions q (n,)."""
    n, T, t = len(q), chain.rotation, chain.position
    axis, anchor = np.empty((n, 3)), np.empty((n, 3))
    x, y, z, p = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    for i in range(n + 1):
        step = along(x, y, z, t[i, 0], t[i, 1], t[i, 2])
        p = (p[0] + step[0], p[1] + step[1], p[2] + step[2])
        x, y, z = (
            along(x, y, z, T[i, 0, 0], T[i, 1, 0], T[i, 2, 0]),
            along(x, y, z, T[i, 0, 1], T[i, 1, 1], T[i, 2, 1]),
            along(x, y, z, T[i, 0, 2], T[i, 1, 2], T[i, 2, 2]),
        )
        if i == n:
            break
        axis[i, 0], axis[i, 1], axis[i, 2] = z
        anchor[i, 0], anchor[i, 1], anchor[i, 2] = p
        if chain.sliding[i]:
            p = (p[0] + q[i] * z[0], p[1] + q[i] * z[1], p[2] + q[i] * z[2])
        else:
            c, s = np.cos(q[i]), np.sin(q[i])
            x, y = along(x, y, z, c, s, 0.0), along(x, y, z, -s, c, 0.0)
    R = np.empty((3, 3))
    R[0, 0], R[1, 0], R[2, 0] = x
    R[0, 1], R[1, 1], R[2, 1] = y
    R[0, 2], R[1, 2], R[2, 2] = z
    tip = np.empty(3)
    tip[0], tip[1], tip[2] = p
    return ChainState(axis, anchor, R, tip)


@njit(cache=True, error_model="numpy")
def world_jacobian(chain: Chain, state: ChainState) -> FloatArray:
    """Return J (6, n): (v, ω) of the tip along world axes = J q̇."""
    n = len(state.axis)
    J = np.empty((6, n))
    for i in range(n):
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
    return J


@njit(cache=True, error_model="numpy")
def forward_kinematics(chain: Chain, q: FloatArray) -> FloatArray:
    """Return T_world_tip (4, 4) at joint positions q (n,)."""
    state = chain_state(chain, q)
    T = np.eye(4)
    T[:3, :3] = state.R
    T[:3, 3] = state.p
    return T


@njit(cache=True, error_model="numpy")
def jacobian(chain: Chain, q: FloatArray) -> FloatArray:
    """Return the tip's Jacobian (6, n) in its own frame: v_tip = J q̇, v_camera for a camera.

    The chain is walked from the tip to the base, every axis z and a point o on it drawn in the
    tip's frame: a turning joint moves the tip by (o × z, z), a sliding one by (z, 0).
    """
    n, T, t = len(q), chain.rotation, chain.position
    J = np.empty((6, n))
    x, y, z, o = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    for i in range(n - 1, -1, -1):
        x, y, z = (
            along(x, y, z, T[i + 1, 0, 0], T[i + 1, 0, 1], T[i + 1, 0, 2]),
            along(x, y, z, T[i + 1, 1, 0], T[i + 1, 1, 1], T[i + 1, 1, 2]),
            along(x, y, z, T[i + 1, 2, 0], T[i + 1, 2, 1], T[i + 1, 2, 2]),
        )
        step = along(x, y, z, t[i + 1, 0], t[i + 1, 1], t[i + 1, 2])
        o = (o[0] - step[0], o[1] - step[1], o[2] - step[2])
        if chain.sliding[i]:
            J[0, i], J[1, i], J[2, i] = z
            J[3, i] = J[4, i] = J[5, i] = 0.0
            o = (o[0] - q[i] * z[0], o[1] - q[i] * z[1], o[2] - q[i] * z[2])
        else:
            J[0, i] = o[1] * z[2] - o[2] * z[1]
            J[1, i] = o[2] * z[0] - o[0] * z[2]
            J[2, i] = o[0] * z[1] - o[1] * z[0]
            J[3, i], J[4, i], J[5, i] = z
            c, s = np.cos(q[i]), np.sin(q[i])
            x, y = along(x, y, z, c, -s, 0.0), along(x, y, z, s, c, 0.0)
    return J
