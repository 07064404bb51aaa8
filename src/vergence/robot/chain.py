"""A serial chain of joints as arrays, and its kinematics as kernels."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray


class Chain(NamedTuple):
    """Joints from the world to a tip; every joint moves about or along the z axis of its frame.

    With T_i = [rotation[i], position[i]] fixed and Z_i(q_i) the motion of joint i,
    T_world_tip(q) = T_0 Z_0(q_0) T_1 Z_1(q_1) … T_n.
    """

    rotation: FloatArray  # (n + 1, 3, 3)
    position: FloatArray  # (n + 1, 3) m
    sliding: BoolArray  # (n,) True where a joint slides


class ChainState(NamedTuple):
    """Where the chain's axes and its tip are, along world axes."""

    axis: FloatArray  # (n, 3) unit vectors of the joints
    anchor: FloatArray  # (n, 3) a point on each axis, m
    R: FloatArray  # (3, 3) of T_world_tip
    p: FloatArray  # (3,) of T_world_tip, m


@njit(cache=True)
def chain_state(chain: Chain, q: FloatArray) -> ChainState:
    """Walk the chain at joint positions q (n,)."""
    n = len(q)
    axis, anchor = np.empty((n, 3)), np.empty((n, 3))
    R, p, R_next = np.eye(3), np.zeros(3), np.empty((3, 3))
    for i in range(n + 1):
        T_R, T_p = chain.rotation[i], chain.position[i]
        for r in range(3):
            p[r] += R[r, 0] * T_p[0] + R[r, 1] * T_p[1] + R[r, 2] * T_p[2]
            for c in range(3):
                R_next[r, c] = R[r, 0] * T_R[0, c] + R[r, 1] * T_R[1, c] + R[r, 2] * T_R[2, c]
        R, R_next = R_next, R
        if i == n:
            break
        cosine, sine = (1.0, 0.0) if chain.sliding[i] else (np.cos(q[i]), np.sin(q[i]))
        for r in range(3):
            axis[i, r], anchor[i, r] = R[r, 2], p[r]
            x, y = R[r, 0], R[r, 1]
            R[r, 0], R[r, 1] = cosine * x + sine * y, cosine * y - sine * x
            if chain.sliding[i]:
                p[r] += q[i] * R[r, 2]
    return ChainState(axis, anchor, R, p)


@njit(cache=True)
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


@njit(cache=True)
def to_tip_axes(R: FloatArray, world: FloatArray) -> FloatArray:
    """Turn the two halves of (6, n) from world axes to the tip's: blkdiag(Rᵀ, Rᵀ) world."""
    turned = np.empty_like(world)
    for i in range(world.shape[1]):
        for r in range(3):
            turned[r, i] = R[0, r] * world[0, i] + R[1, r] * world[1, i] + R[2, r] * world[2, i]
            turned[r + 3, i] = (
                R[0, r] * world[3, i] + R[1, r] * world[4, i] + R[2, r] * world[5, i]
            )
    return turned


@njit(cache=True)
def forward_kinematics(chain: Chain, q: FloatArray) -> FloatArray:
    """Return T_world_tip (4, 4) at joint positions q (n,)."""
    state = chain_state(chain, q)
    T = np.eye(4)
    T[:3, :3] = state.R
    T[:3, 3] = state.p
    return T


@njit(cache=True)
def jacobian(chain: Chain, q: FloatArray) -> FloatArray:
    """Return the tip's Jacobian (6, n) in its own frame: v_tip = J q̇, v_camera for a camera."""
    state = chain_state(chain, q)
    return to_tip_axes(state.R, world_jacobian(chain, state))
