"""Rods between joints, in place of missing shapes of a URDF's links."""

from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element

import numpy as np

from vergence.arrays import FloatArray
from vergence.robot.bounded_xml import numbers
from vergence.robot.urdf_shapes import Shapes
from vergence.robot.urdf_tree import Tree, link_of

_SLENDER = 0.2  # radius of a rod relative to its length
_THICKEST_M, _SHORTEST_M = 0.035, 0.01


def add_rods(tree: Tree, shapes: Shapes) -> None:
    """Give each link that lost all its shapes a rod to each of its joints, in its own frame.

    Rods are visible to cameras, and count as the link's body in collision avoidance.
    """
    bare = {name for name in shapes.undrawn if tree.links[name].find("visual") is None}
    bare -= {name for name in bare if tree.links[name].find("collision") is not None}
    for joint in tree.joints.values():
        if (name := link_of(joint, "parent")) not in bare:
            continue
        origin, end = joint.find("origin"), np.zeros(3)
        if origin is not None:
            where = f"origin of joint {joint.get('name')}"
            end = np.array(numbers(origin, "xyz", (0.0, 0.0, 0.0), tree.source, where))
        if np.linalg.norm(end) > _SHORTEST_M:
            _add_rod(tree.links[name], end)


def _add_rod(link: Element, end: FloatArray) -> None:
    """Add a rod from a link's origin to a point (3,), m."""
    length = float(np.linalg.norm(end))
    x, y, z = end / length
    rpy = (0.0, np.arctan2(np.hypot(x, y), z), np.arctan2(y, x))  # z axis along the rod
    visual = ET.SubElement(link, "visual")
    ET.SubElement(visual, "origin", {"xyz": _text(end / 2), "rpy": _text(rpy)})
    size = {"radius": f"{min(_SLENDER * length, _THICKEST_M):.6g}", "length": f"{length:.9g}"}
    ET.SubElement(ET.SubElement(visual, "geometry"), "cylinder", size)


def _text(values: FloatArray | tuple[float, ...]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
