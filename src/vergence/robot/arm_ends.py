"""Where the arms of a model end: the bodies on which a camera is likely to be mounted."""

import re
from typing import Any, NamedTuple

import mujoco

_FINGER_JOINTS = 3  # at most, from a hand to the tips of its fingers
_ARM_JOINTS = 3  # at least, from the base to a hand
_SLIDE = mujoco.mjtJoint.mjJNT_SLIDE
_MOVING = (mujoco.mjtJoint.mjJNT_HINGE, _SLIDE)
_FINGER_M = 0.1  # the longest travel of a finger that slides
_FINGER = re.compile("grip|finger|jaw|thumb|knuckle", re.IGNORECASE)  # in names of joints
_TOOL = re.compile(r"tool|tcp|end_?eff|\bee|eef|flange|hand|gripper", re.IGNORECASE)


class ArmEnd(NamedTuple):
    """The end of an arm."""

    body: str
    joint_count: int  # from the base of the model


def arm_ends(spec: Any) -> list[ArmEnd]:
    """Return the ends of the arms of an MjSpec, those with most joints first.

    An arm ends before its fingers, or else at its last link. Of the links that move as one, that
    which is named like a tool is told, or the last.
    """
    ends = [end for child in spec.worldbody.bodies for end in _ends(child, 0)]
    longest = max((end.joint_count for end in ends), default=0)
    arms = [end for end in ends if 2 * end.joint_count > longest]  # legs and heads have fewer
    return sorted(arms, key=lambda end: -end.joint_count)


def bodies_with_joints(spec: Any) -> dict[str, int]:
    """Return the named bodies of an MjSpec, from each base outwards: how many joints move each."""
    found = {}
    reached = [(child, 0) for child in reversed(list(spec.worldbody.bodies))]
    while reached:
        body, before = reached.pop()
        count = before + _joint_count(body)
        if body.name:
            found[body.name] = count
        reached += [(child, count) for child in reversed(list(body.bodies))]
    return found


def _ends(body: Any, before: int) -> list[ArmEnd]:
    count = before + _joint_count(body)
    rigid = _moving_as_one(body)
    branches = [child for one in rigid for child in one.bodies if _joint_count(child)]
    if branches and not (count >= _ARM_JOINTS and _are_fingers(branches)):
        return [end for child in branches for end in _ends(child, count)]
    named = [one.name for one in rigid if one.name]
    tools = [name for name in named if _TOOL.search(name) and "finger" not in name]
    if not count or not named:
        return []
    return [ArmEnd((tools or named)[-1], count)]


def _are_fingers(branches: list[Any]) -> bool:
    joints = [joint for body in branches for joint in body.joints]
    if any(moves_finger(joint.name, joint.type == _SLIDE, *joint.range) for joint in joints):
        return True
    return len(branches) > 1 and max(map(_depth, branches)) <= _FINGER_JOINTS


def moves_finger(name: str, slides: bool, low: float, high: float) -> bool:
    """Return whether a joint seems to open and close a gripper.

    Args:
        name: of the joint.
        slides: whether it is prismatic.
        low: lower end of its range, rad or m.
        high: upper end.
    """
    return bool(_FINGER.search(name)) or (slides and 0.0 < high - low <= _FINGER_M)


def _moving_as_one(body: Any) -> list[Any]:
    """Return a body and those that are fixed to it."""
    fixed = [child for child in body.bodies if not _joint_count(child)]
    return [body, *(one for child in fixed for one in _moving_as_one(child))]


def _depth(body: Any) -> int:
    """Return how many joints are in a row from a body on."""
    return _joint_count(body) + max((_depth(child) for child in body.bodies), default=0)


def _joint_count(body: Any) -> int:
    return sum(joint.type in _MOVING for joint in body.joints)
