"""What has to be known of a run to read its numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, Self

import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.runtime.recording.numbers import array, numbers


class _Limits(Protocol):
    """The part of an arm that a recording keeps."""

    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def q_min(self) -> FloatArray: ...
    @property
    def q_max(self) -> FloatArray: ...
    @property
    def rate_max(self) -> FloatArray: ...


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
    def of(cls, arm: _Limits) -> Self:
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

    def as_json(self) -> dict[str, Any]:
        """Return JSON values of all but the text."""
        return {
            "cell": self.cell,
            "seed": self.seed,
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
        )


def _unlimited(values: Sequence[Any], limit: float) -> FloatArray:
    return np.nan_to_num(array(values), nan=limit)


def _camera_json(camera: Camera) -> dict[str, Any]:
    scalars = ("width", "height", "fx", "fy", "cx", "cy")
    values = {name: getattr(camera, name) for name in scalars}
    return {**values, "distortion": numbers(camera.distortion)}
