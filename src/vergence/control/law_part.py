"""A whole law of a user's own, as a cell file declares it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

from vergence.arrays import FloatArray
from vergence.control.law import Law
from vergence.control.mounting import CameraMounting
from vergence.robot import Arm


@dataclass(frozen=True, slots=True)
class LawSetting:
    """What a law is made for.

    Attributes:
        arm: up to its tip: the task's camera, or the target where the arm holds it before a fixed
            camera.
        cameras: and where they are, by name; the task's first.
        depth_m: believed depth of a camera's features at the start, (M,), by camera; without those
            of which nothing is known.
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
    """A part that makes laws: what a cell names, with its numbers."""

    def bind(self, setting: LawSetting) -> Law:
        """Return the law for one arm and its cameras.

        Raises:
            InputError: if it does not suit them.
        """
        ...
