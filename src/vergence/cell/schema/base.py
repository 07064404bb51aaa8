"""What every table of a cell file is made of: a range, with both ends, for every number."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PlainSerializer, StringConstraints

from vergence.parts import is_part, written

MOST_JOINTS = 64
MOST_POINTS = 1000

# Ranges are those of machines: values outside are mistakes of the number or the unit, and would
# take terabytes or years to simulate.
Coordinate = Annotated[float, Field(ge=-1e3, le=1e3)]  # m
Angle = Annotated[float, Field(ge=-3.6e4, le=3.6e4)]  # degrees; also metres of a sliding joint
HalfTurn = Annotated[float, Field(ge=0, le=180)]  # degrees, however it is turned
Vector3 = tuple[Coordinate, Coordinate, Coordinate]
Angles3 = tuple[Angle, Angle, Angle]
Joints = Annotated[tuple[Angle, ...], Field(max_length=MOST_JOINTS)]
Length = Annotated[float, Field(ge=1e-6, le=1e3)]  # m
Distance = Annotated[float, Field(ge=0, le=1e3)]  # m
Speed = Annotated[float, Field(ge=1e-6, le=100)]  # m/s
JointRate = Annotated[float, Field(ge=1e-3, le=1e5)]  # degrees/s, degrees/s²; m/s, m/s²
Time = Annotated[float, Field(ge=0, le=86400)]  # s
Duration = Annotated[float, Field(ge=1e-3, le=86400)]  # s
Rate = Annotated[float, Field(ge=1e-2, le=1e4)]  # Hz
Gain = Annotated[float, Field(ge=1e-4, le=1e3)]  # 1/s, or without a unit
Pixels = Annotated[float, Field(ge=0, le=1e4)]
PixelCoordinate = Annotated[float, Field(ge=-1e5, le=1e5)]
Point2 = tuple[PixelCoordinate, PixelCoordinate]
Axis = Literal["x", "y", "z", "rx", "ry", "rz"]
Text = Annotated[str, StringConstraints(max_length=200)]
# Of what messages speak of. Bounded in the pattern itself it would take ten times as long to load.
Name = Annotated[str, StringConstraints(pattern=r"^\w[\w .-]*$", max_length=64)]


def _written(part: Any) -> Any:
    return written(part) if is_part(part) else part


Part = Annotated[Any, PlainSerializer(_written)]  # as its declaration reads it, see `registry`


class Table(BaseModel):
    """A table of the file: unknown keys are mistakes, numbers finite, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Placement(Table):
    """A pose: a position and roll-pitch-yaw angles, R = Rz(yaw) Ry(pitch) Rx(roll)."""

    position_m: Vector3 = (0.0, 0.0, 0.0)  # x, y, z of the origin
    rotation_rpy_deg: Angles3 = (0.0, 0.0, 0.0)  # roll, pitch, yaw


class TaskTable(Table):
    """What every task has."""

    name: Name | None = None  # name in messages and reports; the kind of the task if absent
    target: Name | None = None  # name of one of [targets]; may be absent if there is only one
    law: Name | None = None  # name of one of [laws], only in [[tasks]]; [law] if absent
    until: Part = None  # condition that ends the task; if absent, a task with a goal ends there

    @property
    def called(self) -> str:
        """What messages and reports call it."""
        return self.name or str(getattr(self, "kind", "task"))
