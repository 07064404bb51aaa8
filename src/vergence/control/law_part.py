"""A user's own complete law, as a cell file declares it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

from vergence.arrays import FloatArray
from vergence.control.law import Law
from vergence.control.mounting import CameraMounting
from vergence.robot import Arm


@dataclass(frozen=True, slots=True)
class LawSetting:
    """The input from which a law is made.

    Attributes:
        arm: up to its tip: the task's camera, or the target if the arm holds it in front of a fixed
            camera.
        cameras: the cameras with their poses, by name; the task's first.
        depth_m: believed depth of a camera's features at the start, (M,), by camera; only those
            that are known.
        period_s: between two images of the task's camera, s.
        inner_period_s: between two set-points, s.
        start: joint positions at the start, (n,), rad or m.
    """

    arm: Arm
    cameras: Mapping[str, CameraMounting]
    depth_m: Mapping[str, FloatArray] = field(default_factory=dict)
    period_s: float = 1 / 30
    inner_period_s: float = 1 / 500
    start: FloatArray | None = None


@runtime_checkable
class LawPart(Protocol):
    """A part that makes laws: its name in a cell file, with its settings."""

    def bind(self, setting: LawSetting) -> Law:
        """Return the law for one arm and its cameras.

        Raises:
            InputError: if it does not suit them.
        """
        ...
