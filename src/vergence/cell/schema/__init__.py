"""The tables of a cell file, typed."""

from vergence.cell.schema.base import (
    Axis,
    Duration,
    Name,
    Part,
    Placement,
    Table,
    TaskTable,
    Vector3,
)
from vergence.cell.schema.cameras import CameraTable, DepthTable
from vergence.cell.schema.imaging import ImagingTable
from vergence.cell.schema.tables import (
    ArmTable,
    CollisionTable,
    DriverTable,
    OutputTable,
    PerceptionTable,
    SceneTable,
    TargetTable,
)
from vergence.cell.schema.tag import TagTable
from vergence.cell.schema.tasks import (
    AdvanceTable,
    FollowTable,
    LengthTable,
    ReachTable,
    SwitchTable,
    Task,
    ToolTable,
    TrackTable,
)

__all__ = [
    "AdvanceTable",
    "ArmTable",
    "Axis",
    "CameraTable",
    "CollisionTable",
    "DepthTable",
    "DriverTable",
    "Duration",
    "FollowTable",
    "ImagingTable",
    "LengthTable",
    "Name",
    "Part",
    "OutputTable",
    "PerceptionTable",
    "Placement",
    "ReachTable",
    "SceneTable",
    "SwitchTable",
    "TABLES",
    "Table",
    "TagTable",
    "TargetTable",
    "Task",
    "TaskTable",
    "ToolTable",
    "TrackTable",
    "Vector3",
]

# What is at a place in the file, or its kind.
TABLES: dict[str, type[Table]] = {
    "depth": DepthTable,
    "imaging": ImagingTable,
    "Placement": Placement,  # by pydantic's name: it has no kind
    "scene": SceneTable,
    "arms": ArmTable,
    "cameras": CameraTable,
    "collision": CollisionTable,
    "target": TargetTable,
    "targets": TargetTable,
    "tag": TagTable,
    "track": TrackTable,
    "tool": ToolTable,
    "follow": FollowTable,
    "reach": ReachTable,
    "length": LengthTable,
    "advance": AdvanceTable,
    "switch": SwitchTable,
    "outputs": OutputTable,
    "perception": PerceptionTable,
    "driver": DriverTable,
}
