"""The links and joints of a URDF as a tree."""

from collections.abc import Mapping
from typing import NamedTuple
from xml.etree.ElementTree import Element

from vergence.errors import Absent, InputError, nearest

MOVING = ("revolute", "continuous", "prismatic")
_KINDS = (*MOVING, "fixed", "floating", "planar")


class Tree(NamedTuple):
    """A URDF whose links are connected."""

    source: str  # the file
    links: Mapping[str, Element]  # by name
    joints: Mapping[str, Element]  # by name
    above: Mapping[str, Element]  # the joint that carries each link, by the link's name

    def path_to(self, link: str) -> list[Element]:
        """Return the joints from the base to a link, base first."""
        path: list[Element] = []
        while link in self.above:
            path.insert(0, self.above[link])
            link = link_of(self.above[link], "parent")
        return path


def read_tree(robot: Element, source: str) -> Tree:
    """Return the links and joints of a robot.

    Raises:
        InputError: if names are missing, duplicate or unknown, or the links do not form a tree:
            a closed loop, or several roots.
    """
    links = _by_name(robot, "link", source)
    joints = _by_name(robot, "joint", source)
    above: dict[str, Element] = {}
    for name, joint in joints.items():
        kind = joint.get("type", "")
        if kind not in _KINDS:
            raise InputError(source, f"type of joint {name}", kind, nearest(kind, _KINDS))
        for end in ("parent", "child"):
            if (link := link_of(joint, end)) not in links:
                raise InputError(source, f"{end} of joint {name}", link, nearest(link, links))
        child = link_of(joint, "child")
        if child in above:
            given = f"two joints that carry it, {above[child].get('name')} and {name}"
            raise InputError(source, f"link {child}", given, "one: a tree, without closed loops")
        above[child] = joint
    tree = Tree(source, links, joints, above)
    _check_connected(tree)
    return tree


def link_of(joint: Element, end: str) -> str:
    """Return the name of a joint's parent or child."""
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


def _by_name(robot: Element, tag: str, source: str) -> dict[str, Element]:
    named: dict[str, Element] = {}
    for element in robot.findall(tag):
        name = element.get("name", "")
        if not name or name in named:
            given = "two of the same name" if name else "one without a name"
            raise InputError(source, f"{tag} {name}".strip(), given, f"a name for each {tag}")
        named[name] = element
    return named


def _check_connected(tree: Tree) -> None:
    roots = [name for name in tree.links if name not in tree.above]
    if len(roots) > 1:
        given = f"{len(roots)} that no joint carries: {', '.join(roots[:5])}"
        raise InputError(tree.source, "links", given, "one root link, connected to all others")
    below: dict[str, list[str]] = {}
    for child, joint in tree.above.items():
        below.setdefault(link_of(joint, "parent"), []).append(child)
    reached, waiting = set(roots), list(roots)
    while waiting:
        found = below.get(waiting.pop(), [])
        reached.update(found)
        waiting += found
    if lost := [name for name in tree.links if name not in reached]:
        given = f"joints that form a loop through link {lost[0]}" if tree.links else Absent("none")
        raise InputError(tree.source, "joints", given, "a tree of links with one root")
    if not tree.links:
        raise InputError(tree.source, "links", Absent("none"), "at least one")
