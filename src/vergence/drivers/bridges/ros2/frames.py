"""Poses of frames in each other, from TF."""

from typing import Any

_STILL = (
    1e-4  # m, or of a quaternion, by which a fixed transform may differ from one time to the next
)

_UNIT = 0.01  # by which the square of a quaternion's length may differ from 1

# x, y, z of a frame's origin in its parent, m, and the quaternion x, y, z, w of its axes.
Transform = tuple[float, ...]


class Frames:
    """The tree of TF as far as it is known."""

    def __init__(self) -> None:
        self._links: dict[str, tuple[str, Transform]] = {}  # by child: its parent, and where it is
        self._moving: set[str] = set()  # children that were told at different places

    def take(self, message: Any) -> None:
        """Take in a `tf2_msgs/TFMessage`."""
        for told in message.transforms:
            origin, turn = told.transform.translation, told.transform.rotation
            here = (origin.x, origin.y, origin.z, turn.x, turn.y, turn.z, turn.w)
            if not abs(sum(value * value for value in here[3:]) - 1.0) < _UNIT:
                continue  # no rotation
            child, parent = _name(told.child_frame_id), _name(told.header.frame_id)
            if (before := self._links.get(child)) and _apart(before[1], here):
                self._moving.add(child)
            self._links[child] = parent, here

    def between(self, parent: str, child: str) -> tuple[list[Transform], list[Transform]] | None:
        """Return the transforms from the nearest common ancestor to a parent and to a child.

        None if nothing connects the two.
        """
        up, down = self._line(_name(parent)), self._line(_name(child))
        common = next((frame for frame in up if frame in down), None)
        if common is None:
            return None
        lines = (line[: line.index(common)] for line in (up, down))
        to_parent, to_child = ([self._links[f][1] for f in reversed(line)] for line in lines)
        return to_parent, to_child

    def wrong(self, parent: str, child: str) -> str:
        """Return why a frame is not known in another, in a sentence; empty if it can."""
        if self.between(parent, child) is None:
            known = sorted(self._links.keys() | {parent for parent, _ in self._links.values()})
            frames = f"it has {', '.join(known[:20])}" if known else "it has received no transforms"
            return f"TF does not connect {parent} with {child}; {frames}"
        up, down = self._line(_name(parent)), self._line(_name(child))
        moves = [frame for frame in {*up} ^ {*down} if frame in self._moving]
        return f"{child} moves against {parent} in TF, at {min(moves)}" if moves else ""

    def _line(self, frame: str) -> list[str]:
        """Return a frame and all above it, the nearest first."""
        line = [frame]
        while (link := self._links.get(line[-1])) is not None and link[0] not in line:
            line.append(link[0])
        return line


def _name(frame: str) -> str:
    return frame.lstrip("/")


def _apart(a: Transform, b: Transform) -> bool:
    """Return whether two transforms differ; a quaternion and its negative are the same."""
    sign = 1.0 if sum(x * y for x, y in zip(a[3:], b[3:], strict=True)) >= 0.0 else -1.0
    turned = any(abs(x - sign * y) > _STILL for x, y in zip(a[3:], b[3:], strict=True))
    return turned or any(abs(x - y) > _STILL for x, y in zip(a[:3], b[:3], strict=True))
