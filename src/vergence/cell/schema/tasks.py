"""The tasks in a cell file."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from vergence.cell.schema.base import (
    MOST_POINTS,
    Coordinate,
    Duration,
    Joints,
    Length,
    Part,
    Pixels,
    Placement,
    Point2,
    Speed,
    Table,
    TaskTable,
    Text,
    Vector3,
)

_Desired = (
    Literal["initial", "centred"] | Annotated[tuple[Point2, ...], Field(max_length=MOST_POINTS)]
)
_ExactNoise = Annotated[float, Field(ge=0, le=100)]  # px, of projections


class ToolTable(Placement):
    """A tool that the arm holds beside its camera; its placement is in the arm's last body."""

    model: Path  # MJCF
    camera: Text  # fixed camera that observes the tool
    # Points x, y, z in the tool's frame.
    features: tuple[Vector3, ...] = Field(min_length=1, max_length=MOST_POINTS)
    desired: _Desired = "initial"  # desired points in that camera, as for the task


class TrackTable(TaskTable):
    """Keep features at their desired positions in one camera's image."""

    kind: Literal["track"] = "track"
    arm: Text  # arm that moves, or carries the target
    camera: Text  # camera on the arm, or a fixed one
    # Number of points to pick, if they are picked.
    feature_count: Annotated[int, Field(ge=1, le=64)] = 1
    # (u, v) of the features in the first image; derived from the target's placement if absent.
    points_px: Annotated[tuple[Point2, ...], Field(max_length=MOST_POINTS)] | None = None
    # As at the start, centred in the image, or (u, v) of each point in pixels.
    desired: _Desired = "initial"
    tracker: Part = "ssd"  # tracker of the features
    # Auto: follow a planned path to the `desired` points if they are given and a path exists.
    approach: Literal["direct", "auto"] = "direct"
    tool: ToolTable | None = None  # tool to be kept in place in the image of a second, fixed camera
    # Standard deviation of a simulated feature's measured position if no images are rendered.
    noise_px: _ExactNoise = 0.0
    tolerance_px: Pixels = 1.0  # an arm at rest with a larger mean error has not reached its goal
    image_timeout_s: Duration = 0.5  # time without an image after which the run ends
    target_timeout_s: Duration = 0.2  # time without any feature found after which the run ends


class FollowTable(TaskTable):
    """Keep a desired pose between target and camera, which is on the arm or fixed."""

    kind: Literal["follow"]
    arm: Text  # arm that moves
    camera: Text  # camera on the arm, or a fixed one if the arm carries the target
    desired: Literal["initial"] | Placement = "initial"  # desired pose of the target in that camera
    image_timeout_s: Duration = 0.5  # time without an image after which the run ends
    target_timeout_s: Duration = 2.0  # time without finding the target after which the run ends


class LengthTable(Table):
    """The known distance between two points in the photograph."""

    points_px: tuple[Point2, Point2]  # (u, v) of both end points in the photograph
    length_m: Length  # distance between them

    @model_validator(mode="after")
    def _apart(self) -> "LengthTable":
        if max(abs(a - b) for a, b in zip(*self.points_px, strict=True)) < 5.0:
            raise ValueError("two points at least 5 pixels apart")
        return self


class ReachTable(TaskTable):
    """Move the camera to where an earlier image of the target was taken, along a planned path."""

    kind: Literal["reach"]
    arm: Text  # arm that moves
    camera: Text  # camera on the arm
    # Photograph of the desired view; NAME.camera.yaml beside it gives its camera.
    goal: Path | None = None
    # Joints at which it was taken, m if prismatic; a simulation can take the photograph there.
    goal_deg: Joints | None = None
    # Approximate distance between camera and object; otherwise estimated while the arm moves.
    distance_m: Length | None = None
    length: LengthTable | None = None  # known length in the photograph, to set the scale
    matcher: Part = "sift"  # method that recognises the photograph
    tolerance_m: Length = 1e-3  # the goal is reached when certainly within this distance
    # The goal is reached when certainly within this angle.
    tolerance_deg: Annotated[float, Field(gt=0, le=180)] = 0.2
    # What a photograph is finished by: its points, or then the grey values of the whole image.
    finish: Literal["points", "luminance"] = "points"
    planner: Part = "optimised"  # planner of the path in the image
    tracker: Part = "round_marks"  # tracker of the features
    margin_px: Pixels = 10.0  # distance to keep from the border of the image
    # Distance to keep from joint limits, as a fraction of half the range.
    margin_joint: Annotated[float, Field(ge=0, lt=0.5)] = 0.01
    camera_speed_m_s: Speed = 0.25  # speed of the camera along the path
    # As fast as limits and camera_speed_m_s allow; or, as in [Mezouar2001], one waypoint per image.
    timing: Literal["limits", "waypoint_per_image"] = "limits"
    # Standard deviation of a simulated feature's measured position if no images are rendered.
    noise_px: _ExactNoise = 0.0
    tolerance_px: Pixels = 1.0  # largest mean error of the farthest feature that counts as reached
    image_timeout_s: Duration = 0.5  # time without an image after which the run ends
    target_timeout_s: Duration = 0.5  # time without finding the target after which the run ends


class AdvanceTable(TaskTable):
    """Move the camera, or the object that the arm holds, along an axis, without using images."""

    kind: Literal["advance"]
    arm: Text  # arm that moves
    camera: Text  # camera on the arm, or a fixed one
    distance_m: Coordinate  # distance to move; negative for backwards
    axis: Literal["x", "y", "z"] = "z"  # axis to move along
    # Frame of the axis, fixed at the start of the task; flange is the arm's last body.
    frame: Literal["camera", "flange", "world"] = "camera"
    speed_m_s: Speed = 0.1  # highest speed
    tolerance_m: Length = 2e-3  # the end is reached within this distance
    image_timeout_s: Duration = 0.5  # time without an image after which the run ends

    @field_validator("distance_m")
    @classmethod
    def _some(cls, distance_m: float) -> float:
        if abs(distance_m) < 1e-4:
            raise ValueError("a distance of at least 0.0001 m, either way")
        return distance_m


class SwitchTable(TaskTable):
    """Switch an output of the driver, such as a gripper, while the arm stays at rest."""

    kind: Literal["switch"]
    arm: Text  # arm that stays at rest
    camera: Text  # camera of the other tasks
    output: Text  # name of one of [outputs]
    value: Annotated[float, Field(ge=0, le=1)]  # 0 for off or open, 1 for on or closed
    wait_s: Duration = 0.5  # time to wait for the output to act
    image_timeout_s: Duration = 0.5  # time without an image after which the run ends


def _task_kind(value: Any) -> str | None:
    if isinstance(value, Table):
        return str(getattr(value, "kind", None))
    return str(value.get("kind", "track")) if isinstance(value, dict) else None


Task = Annotated[
    Annotated[TrackTable, Tag("track")]
    | Annotated[FollowTable, Tag("follow")]
    | Annotated[ReachTable, Tag("reach")]
    | Annotated[AdvanceTable, Tag("advance")]
    | Annotated[SwitchTable, Tag("switch")],
    Discriminator(_task_kind),
]
