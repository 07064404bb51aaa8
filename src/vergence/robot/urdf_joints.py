"""Which joints of a URDF move, are locked or follow others, and their velocity limits."""

import logging
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from vergence.errors import Absent, InputError, nearest
from vergence.geometry import matrix_to_rpy, rpy_to_matrix, so3_exp
from vergence.robot.bounded_xml import numbers
from vergence.robot.urdf_tree import MOVING, Tree

_LOG = logging.getLogger(__name__)
_RADIANS_MAX = 20.0  # larger limits are assumed to be in degrees
_METRES_MAX = 20.0  # no arm is longer
_NO_LIMIT = 1e6  # rad or m: stands for "no limit"


def settle_joints(tree: Tree, last_body: str) -> dict[str, float]:
    """Prepare the joints of an arm in place; return velocity limits by joint, rad/s or m/s.

    - Joints that do not lead to the last body, such as a gripper's, are locked at zero, or at the
      limit nearest to it.
    - A joint whose lower limit equals its upper limit is locked there.
    - A joint that follows a locked one is locked as well; one that follows a moving joint keeps its
      `<mimic>`, which MuJoCo turns into an equality constraint.

    Raises:
        InputError: if a joint that leads to the last body has more than one degree of freedom or no
            limits, or follows a joint that it cannot follow.
    """
    path = tree.path_to(last_body)
    _check_axes(tree, path)
    locked = _locked(tree, path)
    moved = [joint for joint in path if joint.get("type") != "fixed"]
    if moved and all(joint.get("name") in locked for joint in moved):
        given = "joints that cannot move, lower = upper: "
        given += ", ".join(str(joint.get("name")) for joint in moved)
        raise InputError(tree.source, f"link {last_body}", given, "a joint that moves it")
    rates, unlimited = {}, []
    for name, joint in tree.joints.items():
        if name in locked:
            _lock(joint, locked[name], tree.source)
        elif joint in path and joint.get("type") in MOVING:
            rate = _number(joint, "limit", "velocity", 0.0, tree.source)
            if rate < 0:
                key = f"joint {name}: velocity"
                raise InputError(tree.source, key, rate, "a positive limit")
            if rate > 0:
                rates[name] = rate
            elif joint.find("limit[@velocity]") is not None:
                unlimited.append(name)
    if unlimited:
        text = "%s: velocity limits of 0 are ignored: %s"
        _LOG.warning(text, tree.source, ", ".join(unlimited))
    _check_units(tree, path)
    return rates


def lock_motionless(tree: Tree) -> None:
    """Lock joints between equal limits, and those that follow one, of a model that is no arm.

    A `<mimic>` of a joint that does not exist is dropped: MuJoCo would ignore it.
    """
    locked: dict[str, float] = {}
    for name, joint in tree.joints.items():
        mimic = joint.find("mimic")
        if joint.get("type") not in MOVING:
            continue
        if mimic is None:
            low, high = _limits(joint, tree.source, required=False)
            if low == high:
                locked[name] = low
        elif mimic.get("joint") not in tree.joints:
            joint.remove(mimic)
    for name, joint in tree.joints.items():
        mimic = joint.find("mimic")
        leader = "" if mimic is None else mimic.get("joint", "")
        if leader in locked and joint.get("type") in MOVING:
            ratio = _number(joint, "mimic", "multiplier", 1.0, tree.source)
            offset = _number(joint, "mimic", "offset", 0.0, tree.source)
            locked[name] = offset + ratio * locked[leader]
    for name, place in locked.items():
        _lock(tree.joints[name], place, tree.source)


def _locked(tree: Tree, path: Sequence[Element]) -> dict[str, float]:
    """Return the positions of the joints that do not move, rad or m, by name."""
    places: dict[str, float | None] = {}
    for name in tree.joints:
        _place(tree, name, path, places, ())
    left = [name for name, place in places.items() if place is None]
    beside = [name for name in left if tree.joints[name] not in path]
    for name in beside:
        places[name] = _number(tree.joints[name], "mimic", "offset", 0.0, tree.source)
    if beside:
        text = "%s: joints beside the arm are drawn as if the joints they follow were at zero: %s"
        _LOG.warning(text, tree.source, ", ".join(beside))
    return {name: place for name, place in places.items() if place is not None}


def _place(
    tree: Tree,
    name: str,
    path: Sequence[Element],
    places: dict[str, float | None],
    followers: tuple[str, ...],
) -> float | None:
    """Return the position at which a joint is locked, None if it moves; add it to `places`."""
    if name in places:
        return places[name]
    joint, mimic = tree.joints[name], tree.joints[name].find("mimic")
    on_path = joint in path
    if name in followers:
        raise InputError(tree.source, f"mimic of joint {name}", "itself", "another joint")
    if joint.get("type") not in MOVING:
        if on_path and joint.get("type") != "fixed":
            given = f"{joint.get('type')}, between the base and the arm's last body"
            raise InputError(tree.source, f"type of joint {name}", given, f"{', '.join(MOVING)}")
        place: float | None = 0.0
    elif mimic is not None:
        place = _place_of_follower(tree, name, path, places, (*followers, name))
    elif on_path:
        low, high = _limits(joint, tree.source)
        place = low if low == high else None
    else:
        low, high = _limits(joint, tree.source, required=False)
        place = min(max(0.0, low), high)
    places[name] = place
    return place


def _place_of_follower(
    tree: Tree,
    name: str,
    path: Sequence[Element],
    places: dict[str, float | None],
    followers: tuple[str, ...],
) -> float | None:
    joint = tree.joints[name]
    mimic = joint.find("mimic")
    assert mimic is not None
    leader = mimic.get("joint", "")
    key = f"mimic of joint {name}"
    if leader not in tree.joints:
        if joint not in path:
            return 0.0
        raise InputError(tree.source, key, leader, nearest(leader, tree.joints))
    if joint in path and tree.joints[leader] not in path:
        allowed = "a joint between the base and the arm's last body"
        raise InputError(tree.source, key, f"{leader}, which does not carry the arm", allowed)
    ratio = _number(joint, "mimic", "multiplier", 1.0, tree.source)
    offset = _number(joint, "mimic", "offset", 0.0, tree.source)
    place = _place(tree, leader, path, places, followers)
    if place is not None or ratio == 0.0:
        return offset + ratio * (place or 0.0)
    low, high = _limits(joint, tree.source, required=False)
    if joint in path and low == high:
        given = f"lower = upper, though it follows {leader}"
        raise InputError(tree.source, f"limit of joint {name}", given, "lower below upper")
    return None


def _limits(joint: Element, source: str, required: bool = True) -> tuple[float, float]:
    """Return a joint's position limits, infinite if it has none."""
    limit, name = joint.find("limit"), joint.get("name")
    if joint.get("type") == "continuous":
        return -np.inf, np.inf
    if limit is None or (limit.get("lower") is None and limit.get("upper") is None):
        if required:
            allowed = "<limit lower=… upper=…>, or type continuous for a joint without limits"
            raise InputError(
                source, f"limit of joint {name}", Absent("no lower, no upper"), allowed
            )
        return -np.inf, np.inf
    low, high = (_number(joint, "limit", end, 0.0, source) for end in ("lower", "upper"))
    low, high = (np.copysign(np.inf, end) if abs(end) > _NO_LIMIT else end for end in (low, high))
    if required and low > high:
        raise InputError(
            source, f"limit of joint {name}", f"{low:g} … {high:g}", "lower below upper"
        )
    return (low, high) if low <= high else (high, low)


def _number(joint: Element, tag: str, key: str, default: float, source: str) -> float:
    element = joint.find(tag)
    if element is None:
        return default
    return numbers(element, key, (default,), source, f"{tag} of joint {joint.get('name')}")[0]


def _lock(joint: Element, place: float, source: str) -> None:
    """Make a joint fixed at a position, rad or m."""
    where = f"joint {joint.get('name')}"
    if place != 0.0:
        axis = np.array(_axis(joint, source))
        axis /= np.linalg.norm(axis)
        origin = joint.find("origin")
        origin = SubElement(joint, "origin") if origin is None else origin
        p = np.array(numbers(origin, "xyz", (0.0, 0.0, 0.0), source, where))
        rpy = np.array(numbers(origin, "rpy", (0.0, 0.0, 0.0), source, where))
        R = rpy_to_matrix(rpy[::-1].copy())
        if joint.get("type") == "prismatic":
            p += place * (R @ axis)
        else:
            R = R @ so3_exp(place * axis)
        origin.set("xyz", " ".join(repr(float(value)) for value in p))
        origin.set("rpy", " ".join(repr(float(value)) for value in matrix_to_rpy(R)[::-1]))
    joint.set("type", "fixed")
    for tag in ("mimic", "limit", "axis"):
        for element in joint.findall(tag):
            joint.remove(element)


def _axis(joint: Element, source: str) -> tuple[float, ...]:
    element, where = joint.find("axis"), f"axis of joint {joint.get('name')}"
    if element is None:
        return (1.0, 0.0, 0.0)
    axis = numbers(element, "xyz", (1.0, 0.0, 0.0), source, where)
    if not any(axis):
        raise InputError(source, where, element.get("xyz"), "a non-zero vector")
    return axis


def _check_axes(tree: Tree, path: Sequence[Element]) -> None:
    """Reject invalid numbers, and axes of zero length, on the path to the last body."""
    for name, joint in tree.joints.items():
        if (origin := joint.find("origin")) is not None:
            for key in ("xyz", "rpy"):
                numbers(origin, key, (0.0, 0.0, 0.0), tree.source, f"origin of joint {name}")
        if joint in path and joint.get("type") in MOVING:
            _axis(joint, tree.source)


def _check_units(tree: Tree, path: Sequence[Element]) -> None:
    """Warn about values that look like degrees or millimetres."""
    length = 0.0
    for joint in path:
        origin = joint.find("origin")
        if origin is not None:
            place = numbers(origin, "xyz", (0.0, 0.0, 0.0), tree.source, f"{joint.get('name')}")
            length += float(np.linalg.norm(place))
        if joint.get("type") == "revolute":
            low, high = _limits(joint, tree.source, required=False)
            if _RADIANS_MAX < max(abs(low), abs(high)) < np.inf:
                text = "%s: the limits of %s, %g … %g rad, look like degrees; a URDF is in radians"
                _LOG.warning(text, tree.source, joint.get("name"), low, high)
    if length > _METRES_MAX:
        text = "%s: the arm is %.0f m long; the lengths of a URDF are metres, not millimetres"
        _LOG.warning(text, tree.source, length)
