"""The tables of a cell file, typed."""

from vergence.cell.schema.base import (
    Axis,
    Duration,
    Name,
    Part,
    Placement,
    Table,
    Vector3,
)
from vergence.cell.schema.tables import (
    ArmTable,
    CameraTable,
    DriverTable,
    FollowTable,
    LengthTable,
    PerceptionTable,
    ReachTable,
    SceneTable,
    TargetTable,
    Task,
    ToolTable,
    TrackTable,
)

__all__ = [
    "ArmTable",
    "Axis",
    "CameraTable",
    "DriverTable",
    "Duration",
    "FollowTable",
    "LengthTable",
    "Name",
    "Part",
    "PerceptionTable",
    "Placement",
    "ReachTable",
    "SceneTable",
    "TABLES",
    "Table",
    "TargetTable",
    "Task",
    "ToolTable",
    "TrackTable",
    "Vector3",
]

# What stands at a place in the file, or is the kind of what stands there.
TABLES: dict[str, type[Table]] = {
    "Placement": Placement,  # by pydantic's name: it has no kind
    "scene": SceneTable,
    "arms": ArmTable,
    "cameras": CameraTable,
    "target": TargetTable,
    "track": TrackTable,
    "tool": ToolTable,
    "follow": FollowTable,
    "reach": ReachTable,
    "length": LengthTable,
    "perception": PerceptionTable,
    "driver": DriverTable,
}
