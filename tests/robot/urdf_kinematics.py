"""Forward kinematics of a URDF from its XML alone, to hold the project's reader against."""

from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np


def numbers(text: str) -> np.ndarray:
    return np.array([float(word) for word in text.split()])


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def pose(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, p
    return T


def origin(joint: ET.Element) -> np.ndarray:
    found = joint.find("origin")
    attributes = {} if found is None else found.attrib
    r, p, y = numbers(attributes.get("rpy", "0 0 0"))
    ex, ey, ez = np.eye(3)
    R = rotation(ez, y) @ rotation(ey, p) @ rotation(ex, r)
    return pose(R, numbers(attributes.get("xyz", "0 0 0")))


class Urdf:
    """Links, joints and where a link is for given joint positions."""

    def __init__(self, path: Path) -> None:
        robot = ET.parse(path).getroot()
        self.joints = {joint.get("name"): joint for joint in robot.findall("joint")}
        self.above = {joint.find("child").get("link"): joint for joint in self.joints.values()}
        self.links = [link.get("name") for link in robot.findall("link")]

    def path(self, link: str) -> list[ET.Element]:
        found = []
        while link in self.above:
            found.insert(0, self.above[link])
            link = self.above[link].find("parent").get("link")
        return found

    def moving(self, link: str) -> int:
        return sum(joint.get("type") not in ("fixed", None) for joint in self.path(link))

    def position(self, name: str, commanded: dict[str, float]) -> float:
        """Where a joint is: commanded, following another, or bolted."""
        joint = self.joints[name]
        if name in commanded:
            return commanded[name]
        if (mimic := joint.find("mimic")) is not None:
            ratio, offset = (float(mimic.get(k, d)) for k, d in (("multiplier", 1), ("offset", 0)))
            return ratio * self.position(mimic.get("joint"), commanded) + offset
        assert joint.find("limit").get("lower") == joint.find("limit").get("upper")
        return float(joint.find("limit").get("lower"))

    def place(self, link: str, commanded: dict[str, float]) -> np.ndarray:
        """T_root_link (4, 4)."""
        T = np.eye(4)
        for joint in self.path(link):
            T = T @ origin(joint)
            if joint.get("type") == "fixed":
                continue
            found = joint.find("axis")
            axis = numbers("1 0 0" if found is None else found.get("xyz"))
            axis = axis / np.linalg.norm(axis)
            s = self.position(joint.get("name"), commanded)
            slides = joint.get("type") == "prismatic"
            T = T @ (pose(np.eye(3), s * axis) if slides else pose(rotation(axis, s), np.zeros(3)))
        return T
