"""Reading a serial chain from a MuJoCo model."""

from typing import Any, NamedTuple

import mujoco
import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import InputError, nearest
from vergence.robot.chain import Chain
from vergence.robot.mujoco_coupling import (
    joints_above,
    read_coupling,
    shared_limits,
    shared_rates,
)

# MuJoCo's camera looks along -z with y up; ours looks along z with y down.
FROM_MUJOCO_CAMERA = np.diag([1.0, -1.0, -1.0])

_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
_KINDS = {
    "camera": mujoco.mjtObj.mjOBJ_CAMERA,
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "body": mujoco.mjtObj.mjOBJ_BODY,
}


class ReadChain(NamedTuple):
    """The joints that carry a tip, as a model describes them."""

    names: tuple[str, ...]  # of the joints that can be commanded, base first
    axis_names: tuple[str, ...]  # of all axes, including those that follow others
    chain: Chain
    limits: FloatArray  # (n, 2) of position, rad or m
    rate_max: FloatArray  # (n,) rad/s or m/s, inf where the model has no limit


def read_chain(model: Any, tip: str, kind: str) -> ReadChain:
    """Return the chain of the joints that carry a tip, with their limits.

    The transforms are read from the model in its reference configuration, where MuJoCo computes the
    world frame of every axis and anchor, so any nesting of bodies, offsets and fixed joints works.
    """
    tip_id, body = _find_tip(model, tip, kind)
    joints = joints_above(model, body)
    if not joints:
        raise InputError("model", kind, tip, "something that a hinge or slide joint carries")
    for joint in joints:
        if int(model.jnt_type[joint]) not in (_HINGE, _SLIDE):
            raise InputError(
                "model", f"joint {model.joint(joint).name}", "a ball or free joint", "hinge, slide"
            )
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    frames = [_joint_frame(data, joint) for joint in joints]
    frames.append(_tip_frame(data, tip_id, kind))
    sliding = np.array([int(model.jnt_type[j]) == _SLIDE for j in joints])
    reference = np.array([model.qpos0[model.jnt_qposadr[j]] for j in joints])
    coupling = read_coupling(model, joints)
    names = {j: model.joint(j).name or f"joint{i + 1}" for i, j in enumerate(joints)}
    return ReadChain(
        tuple(names[j] for j in coupling.leaders),
        tuple(names.values()),
        _relative(frames, sliding, reference)._replace(coupling=coupling.matrix),
        shared_limits(model, joints, coupling),
        shared_rates([_velocity_limit(model, j) for j in joints], coupling),
    )


def _find_tip(model: Any, tip: str, kind: str) -> tuple[int, int]:
    if kind not in _KINDS:
        raise InputError("model", "kind", kind, ", ".join(_KINDS))
    tip_id = mujoco.mj_name2id(model, _KINDS[kind], tip)
    if tip_id < 0:
        count = {"camera": model.ncam, "site": model.nsite, "body": model.nbody}[kind]
        names = [mujoco.mj_id2name(model, _KINDS[kind], i) or "" for i in range(count)]
        raise InputError("model", kind, tip, nearest(tip, names))
    if kind == "camera":
        return tip_id, int(model.cam_bodyid[tip_id])
    return tip_id, int(model.site_bodyid[tip_id]) if kind == "site" else tip_id


def _joint_frame(data: Any, joint: int) -> tuple[FloatArray, FloatArray]:
    z = data.xaxis[joint] / np.linalg.norm(data.xaxis[joint])
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    return np.column_stack((x, np.cross(z, x), z)), data.xanchor[joint].copy()


def _tip_frame(data: Any, tip_id: int, kind: str) -> tuple[FloatArray, FloatArray]:
    if kind == "camera":
        return data.cam_xmat[tip_id].reshape(3, 3) @ FROM_MUJOCO_CAMERA, data.cam_xpos[tip_id]
    if kind == "site":
        return data.site_xmat[tip_id].reshape(3, 3), data.site_xpos[tip_id]
    return data.xmat[tip_id].reshape(3, 3), data.xpos[tip_id]


def _relative(
    frames: list[tuple[FloatArray, FloatArray]], sliding: Any, reference: FloatArray
) -> Chain:
    """Express every frame in the one before it, with the joint at zero, not at its reference."""
    rotation, position = np.empty((len(frames), 3, 3)), np.empty((len(frames), 3))
    R_before, p_before, undo_R, undo_p = np.eye(3), np.zeros(3), np.eye(3), np.zeros(3)
    for i, (R, p) in enumerate(frames):
        rotation[i] = undo_R @ R_before.T @ R
        position[i] = undo_R @ (R_before.T @ (p - p_before)) + undo_p
        if i == len(sliding):
            break
        R_before, p_before = R, p
        c, s = np.cos(-reference[i]), np.sin(-reference[i])
        undo_R = np.eye(3) if sliding[i] else np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
        undo_p = np.array([0.0, 0.0, -reference[i] if sliding[i] else 0.0])
    for array in (rotation, position, sliding):
        array.flags.writeable = False
    return Chain(rotation, position, sliding)


def _velocity_limit(model: Any, joint: int) -> float:
    """Return the velocity limit that `read_urdf` stored, rad/s or m/s; inf if there is none."""
    name = velocity_limit_name(model.joint(joint).name)
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, name)
    return np.inf if number < 0 else float(model.numeric_data[model.numeric_adr[number]])


def velocity_limit_name(joint: str) -> str:
    """Return the name of the custom number that holds a joint's velocity limit in a model."""
    return f"{joint}/velocity_limit"
