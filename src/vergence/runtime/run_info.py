"""The information about a run that is needed to interpret its numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, Field, StringConstraints

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.robot import Arm
from vergence.runtime.driver import Driver
from vergence.runtime.json_numbers import array, numbers

_Name = Annotated[str, StringConstraints(max_length=200)]
_Number = Annotated[float, Field(ge=-1e9, le=1e9)]
_Numbers = Annotated[tuple[_Number, ...], Field(max_length=14)]
_Limits = Annotated[tuple[_Number | None, ...], Field(max_length=64)]
_Side = Annotated[int, Field(ge=1, le=1 << 14)]
_Focal = Annotated[float, Field(gt=0, le=1e9)]


class _ArmData(BaseModel):
    names: Annotated[tuple[_Name, ...], Field(max_length=64)]
    q_min: _Limits
    q_max: _Limits
    rate_max: _Limits


class _CameraData(BaseModel):
    width: _Side
    height: _Side
    fx: _Focal
    fy: _Focal
    cx: _Number
    cy: _Number
    distortion: _Numbers = ()


class _RunData(BaseModel):
    """The information about a run in a recording, within plausible ranges."""

    cell: _Name
    seed: int | None
    task_camera: _Name
    path: Annotated[str, StringConstraints(max_length=4096)] = ""
    targets: Annotated[tuple[_Name, ...], Field(max_length=64)] = ()
    arms: Annotated[dict[_Name, _ArmData], Field(max_length=64)]
    cameras: Annotated[dict[_Name, _CameraData], Field(max_length=64)]


@dataclass(frozen=True, slots=True)
class ArmInfo:
    """The joints of an arm with their limits; an unlimited joint has infinite limits."""

    names: tuple[str, ...]  # (n,)
    q_min: FloatArray  # (n,) rad or m
    q_max: FloatArray  # (n,) rad or m
    rate_max: FloatArray  # (n,) rad/s or m/s

    def __post_init__(self) -> None:
        for name in ("q_min", "q_max", "rate_max"):
            object.__setattr__(self, name, frozen(getattr(self, name), (len(self.names),), name))

    @classmethod
    def of(cls, arm: Arm) -> Self:
        """Return names and limits of an arm."""
        return cls(tuple(arm.names), arm.q_min, arm.q_max, arm.rate_max)

    def as_json(self) -> dict[str, Any]:
        """Return JSON values; null means no limit."""
        limits = {name: numbers(getattr(self, name)) for name in ("q_min", "q_max", "rate_max")}
        return {"names": list(self.names), **limits}

    @classmethod
    def _of(cls, data: "_ArmData") -> Self:
        return cls(
            data.names,
            _unlimited(data.q_min, -np.inf),
            _unlimited(data.q_max, np.inf),
            _unlimited(data.rate_max, np.inf),
        )


@dataclass(frozen=True, slots=True)
class RunInfo:
    """The cell that was run, its seed, and the arms and cameras in it."""

    cell: str  # name of the cell
    text: str = ""  # text of the cell file
    seed: int | None = None
    arms: Mapping[str, ArmInfo] = field(default_factory=dict)
    cameras: Mapping[str, Camera] = field(default_factory=dict)
    task_camera: str = ""  # the camera that the reference refers to; the first if empty
    path: str = ""  # path of the cell file, with the models beside it
    targets: tuple[str, ...] = ()  # names of the targets; empty for old recordings

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
        targets: tuple[str, ...] = (),
    ) -> Self:
        """Collect the information from a driver and a cell file."""
        arms = {name: ArmInfo.of(arm) for name, arm in driver.arms.items()}
        return cls(cell, text, seed, arms, dict(driver.cameras), task_camera, path, targets)

    def as_json(self) -> dict[str, Any]:
        """Return JSON values of all but the text."""
        return {
            "cell": self.cell,
            "seed": self.seed,
            "task_camera": self.task_camera,
            "path": self.path,
            "targets": list(self.targets),
            "arms": {name: arm.as_json() for name, arm in self.arms.items()},
            "cameras": {name: _camera_json(camera) for name, camera in self.cameras.items()},
        }

    @classmethod
    def from_json(cls, data: str, text: str) -> Self:
        """Read what `as_json` returned, which is untrusted.

        Raises:
            ValueError: if it is not valid.
        """
        given = _RunData.model_validate_json(data)
        return cls(
            given.cell,
            text,
            given.seed,
            {name: ArmInfo._of(arm) for name, arm in given.arms.items()},
            {name: Camera(**camera.model_dump()) for name, camera in given.cameras.items()},
            given.task_camera,
            given.path,
            given.targets,
        )


def _unlimited(values: Sequence[Any], limit: float) -> FloatArray:
    return np.nan_to_num(array(values), nan=limit)


def _camera_json(camera: Camera) -> dict[str, Any]:
    scalars = ("width", "height", "fx", "fy", "cx", "cy")
    values = {name: getattr(camera, name) for name in scalars}
    return {**values, "distortion": numbers(camera.distortion)}
