"""What has to be known of a run to read its numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.robot import Arm
from vergence.runtime.driver import Driver
from vergence.runtime.recording.numbers import array, numbers


@dataclass(frozen=True, slots=True)
class ArmInfo:
    """The joints of an arm and what they may do; an unlimited joint has infinite limits."""

    names: tuple[str, ...]  # (n,)
    q_min: FloatArray  # (n,) rad or m
    q_max: FloatArray  # (n,) rad or m
    rate_max: FloatArray  # (n,) rad/s or m/s

    def __post_init__(self) -> None:
        for name in ("q_min", "q_max", "rate_max"):
            object.__setattr__(self, name, frozen(getattr(self, name), (len(self.names),), name))

    @classmethod
    def of(cls, arm: Arm) -> Self:
        """Keep names and limits of an arm."""
        return cls(tuple(arm.names), arm.q_min, arm.q_max, arm.rate_max)

    def as_json(self) -> dict[str, Any]:
        """Return JSON values; null stands for a limit that is not there."""
        limits = {name: numbers(getattr(self, name)) for name in ("q_min", "q_max", "rate_max")}
        return {"names": list(self.names), **limits}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """Read what `as_json` returned."""
        return cls(
            tuple(data["names"]),
            _unlimited(data["q_min"], -np.inf),
            _unlimited(data["q_max"], np.inf),
            _unlimited(data["rate_max"], np.inf),
        )


@dataclass(frozen=True, slots=True)
class RunInfo:
    """The cell that was run, its seed, and the arms and cameras in it."""

    cell: str  # name of the cell
    text: str = ""  # the cell file, word for word
    seed: int | None = None
    arms: Mapping[str, ArmInfo] = field(default_factory=dict)
    cameras: Mapping[str, Camera] = field(default_factory=dict)
    task_camera: str = ""  # the one whose points the reference speaks of; the first if empty
    path: str = ""  # where the cell file was, with the models beside it

    def __post_init__(self) -> None:
        if not self.task_camera:
            object.__setattr__(self, "task_camera", next(iter(self.cameras), ""))

    @classmethod
    def of(
        cls,
        driver: Driver,
        cell: str,
        text: str,
        seed: int | None,
        task_camera: str = "",
        path: str = "",
    ) -> Self:
        """Keep what a driver and a cell file say."""
        arms = {name: ArmInfo.of(arm) for name, arm in driver.arms.items()}
        return cls(cell, text, seed, arms, dict(driver.cameras), task_camera, path)

    def as_json(self) -> dict[str, Any]:
        """Return JSON values of all but the text."""
        return {
            "cell": self.cell,
            "seed": self.seed,
            "task_camera": self.task_camera,
            "path": self.path,
            "arms": {name: arm.as_json() for name, arm in self.arms.items()},
            "cameras": {name: _camera_json(camera) for name, camera in self.cameras.items()},
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any], text: str) -> Self:
        """Read what `as_json` returned."""
        return cls(
            data["cell"],
            text,
            data["seed"],
            {name: ArmInfo.from_json(arm) for name, arm in data["arms"].items()},
            {name: Camera(**camera) for name, camera in data["cameras"].items()},
            data["task_camera"],
            data.get("path", ""),
        )


def _unlimited(values: Sequence[Any], limit: float) -> FloatArray:
    return np.nan_to_num(array(values), nan=limit)


def _camera_json(camera: Camera) -> dict[str, Any]:
    scalars = ("width", "height", "fx", "fy", "cx", "cy")
    values = {name: getattr(camera, name) for name in scalars}
    return {**values, "distortion": numbers(camera.distortion)}
