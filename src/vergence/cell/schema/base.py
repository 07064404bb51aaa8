"""What every table of a cell file is made of."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Vector3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
Axis = Literal["x", "y", "z", "rx", "ry", "rz"]


class Table(BaseModel):
    """A table of the file: unknown keys are mistakes, numbers finite, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Placement(Table):
    """A pose: a position and roll-pitch-yaw angles, R = Rz(yaw) Ry(pitch) Rx(roll)."""

    position_m: Vector3 = (0.0, 0.0, 0.0)  # x, y, z of its origin
    rotation_rpy_deg: Vector3 = (0.0, 0.0, 0.0)  # roll, pitch, yaw
