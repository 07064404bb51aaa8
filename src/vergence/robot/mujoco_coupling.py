"""Which joints of a MuJoCo model follow others: mimic joints of a URDF, equality constraints."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import InputError
from vergence.robot.chain import UNCOUPLED

_JOINT, _TENDON = int(mujoco.mjtEq.mjEQ_JOINT), int(mujoco.mjtEq.mjEQ_TENDON)
_LOOPS = {int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)}


class Follows(NamedTuple):
    """A joint that follows another: position = ratio · leader + offset."""

    leader: int
    ratio: float
    offset: float  # rad or m


class Coupling(NamedTuple):
    """Which axes of a chain can be commanded, and how these move the others."""

    leaders: list[int]  # MuJoCo's joint ids of those that follow no other joint, base first
    matrix: FloatArray  # (m, 3) as in `Chain`; (0, 3) if every joint can be commanded


def read_coupling(model: Any, joints: Sequence[int]) -> Coupling:
    """Return how the joints of a chain are coupled.

    Args:
        model: any compiled model.
        joints: ids of the joints of the chain, base first.

    Raises:
        InputError: if a joint follows one outside the chain, itself or several joints, or follows
            nonlinearly; or if a constraint closes a loop over the chain.
    """
    follows: dict[int, Follows] = {}
    for constraint in np.flatnonzero(model.eq_active0):
        kind = int(model.eq_type[constraint])
        if kind == _JOINT and int(model.eq_obj1id[constraint]) in joints:
            joint = int(model.eq_obj1id[constraint])
            if joint in follows:
                raise _refused(model, joint, "follows two joints", "one that it follows")
            follows[joint] = _follows(model, int(constraint), joints)
        elif kind in _LOOPS or kind == _TENDON:
            _refuse_loop(model, int(constraint), joints)
    if not follows:
        return Coupling(list(joints), UNCOUPLED)
    leaders = [joint for joint in joints if joint not in follows]
    rows = [_to_leader(model, joint, follows) for joint in joints]
    matrix = np.array([(leaders.index(row.leader), row.ratio, row.offset) for row in rows])
    matrix.flags.writeable = False
    return Coupling(leaders, matrix)


def shared_limits(model: Any, joints: Sequence[int], coupling: Coupling) -> FloatArray:
    """Return position limits (n, 2) of the joints that can be commanded.

    They also keep the joints that follow within their limits.

    Raises:
        InputError: if limits are reversed or equal, or leave a joint no range.
    """
    own = [_own_limits(model, joint) for joint in joints]
    if not len(coupling.matrix):
        return np.array(own)
    limits = np.tile((-np.inf, np.inf), (len(coupling.leaders), 1))
    for joint, (low, high), (j, ratio, offset) in zip(joints, own, coupling.matrix, strict=True):
        ends = sorted(((low - offset) / ratio, (high - offset) / ratio))
        limit = limits[int(j)]
        limit[:] = max(limit[0], ends[0]), min(limit[1], ends[1])
        if not limit[0] < limit[1]:
            leader = model.joint(coupling.leaders[int(j)]).name
            given = f"a range that leaves {leader}, which it follows, no range"
            raise _refused(model, joint, given, "ranges that overlap")
    return limits


def shared_rates(own: Sequence[float], coupling: Coupling) -> FloatArray:
    """Return rate limits (n,) of the joints that can be commanded, from those of all axes (m,)."""
    if not len(coupling.matrix):
        return np.array(own)
    rates = np.full(len(coupling.leaders), np.inf)
    for rate, (j, ratio, _) in zip(own, coupling.matrix, strict=True):
        rates[int(j)] = min(rates[int(j)], rate / abs(ratio))
    return rates


def joints_above(model: Any, body: int) -> list[int]:
    """Return the joints that move a body, base first."""
    joints: list[int] = []
    while body > 0:
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        joints[:0] = range(first, first + count)
        body = int(model.body_parentid[body])
    return joints


def _own_limits(model: Any, joint: int) -> tuple[float, float]:
    low, high = (float(end) for end in model.jnt_range[joint])
    if low > high or (low == high and low != 0.0):  # MuJoCo would treat it as unlimited
        allowed = "lower below upper"
        if low == high:
            allowed += "; a joint that cannot move is left out of an MJCF"
        raise InputError(
            "model", f"range of {model.joint(joint).name}", f"{low:g} … {high:g}", allowed
        )
    return (low, high) if model.jnt_limited[joint] else (-np.inf, np.inf)


def _follows(model: Any, constraint: int, joints: Sequence[int]) -> Follows:
    joint, leader = int(model.eq_obj1id[constraint]), int(model.eq_obj2id[constraint])
    constant, ratio, *higher = (float(value) for value in model.eq_data[constraint, :5])
    if leader not in joints:
        other = model.joint(leader).name if leader >= 0 else "no joint"
        allowed = "a joint between the base and the arm's last body"
        raise _refused(model, joint, f"follows {other}", allowed)
    if ratio == 0.0 or any(higher):
        given = f"follows {model.joint(leader).name} by polycoef {model.eq_data[constraint, :5]}"
        raise _refused(model, joint, given, "a ratio other than zero, and no higher powers")
    rest, leader_rest = (float(model.qpos0[model.jnt_qposadr[j]]) for j in (joint, leader))
    return Follows(leader, ratio, rest + constant - ratio * leader_rest)


def _to_leader(model: Any, joint: int, follows: dict[int, Follows]) -> Follows:
    """Return how a joint follows a joint that follows none, through any in between."""
    ratio, offset, at = 1.0, 0.0, joint
    passed = {joint}
    while at in follows:
        step = follows[at]
        offset, ratio, at = offset + ratio * step.offset, ratio * step.ratio, step.leader
        if at in passed:
            raise _refused(model, joint, "follows itself", "a joint that leads")
        passed.add(at)
    return Follows(at, ratio, offset)


def _refuse_loop(model: Any, constraint: int, joints: Sequence[int]) -> None:
    """Reject a constraint that couples two parts of the chain other than by following."""
    if int(model.eq_type[constraint]) == _TENDON:
        tied = _of_tendon(model, int(model.eq_obj1id[constraint])) & set(joints)
    else:
        ends = (int(model.eq_obj1id[constraint]), int(model.eq_obj2id[constraint]))
        if int(model.eq_objtype[constraint]) == int(mujoco.mjtObj.mjOBJ_SITE):
            ends = (int(model.site_bodyid[ends[0]]), int(model.site_bodyid[ends[1]]))
        first, second = (set(joints_above(model, body)) & set(joints) for body in ends)
        tied = first ^ second
    if tied:
        kind = mujoco.mjtEq(int(model.eq_type[constraint])).name.removeprefix("mjEQ_").lower()
        given = f"a {kind} constraint over it, which closes a loop"
        raise _refused(model, min(tied), given, "an open chain; joints may follow others")


def _of_tendon(model: Any, tendon: int) -> set[int]:
    first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    joint = int(mujoco.mjtWrap.mjWRAP_JOINT)
    return {
        int(model.wrap_objid[i])
        for i in range(first, first + count)
        if int(model.wrap_type[i]) == joint
    }


def _refused(model: Any, joint: int, given: str, allowed: str) -> InputError:
    return InputError("model", f"joint {model.joint(joint).name}", given, allowed)
