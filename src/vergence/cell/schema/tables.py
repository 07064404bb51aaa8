"""Arms, cameras, target, task and perception in a cell file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Discriminator, Field, Tag, field_validator, model_validator

from vergence.cell.schema.base import (
    MOST_JOINTS,
    MOST_POINTS,
    Angle,
    Coordinate,
    Distance,
    Duration,
    JointRate,
    Length,
    Name,
    Part,
    Pixels,
    Placement,
    Point2,
    Rate,
    Speed,
    Table,
    TaskTable,
    Text,
    Time,
    Vector3,
)
from vergence.parts import kind_of

_MOST_WAYPOINTS = 1000
_Side = Annotated[int, Field(ge=16, le=8192)]
_Joints = Annotated[tuple[Angle, ...], Field(max_length=MOST_JOINTS)]
_JointRates = JointRate | Annotated[tuple[JointRate, ...], Field(max_length=MOST_JOINTS)]
_Focal = Annotated[float, Field(ge=1, le=1e6)]  # px
_Lens = Annotated[float, Field(ge=1e-2, le=1e4)]  # mm, or µm of a pixel
_Features = Annotated[tuple[Vector3, ...], Field(max_length=MOST_POINTS)]
_Desired = (
    Literal["initial", "centred"] | Annotated[tuple[Point2, ...], Field(max_length=MOST_POINTS)]
)
_Angle = Annotated[float, Field(ge=0, le=180)]  # degrees
_Noise = Annotated[float, Field(ge=1e-4, le=100)]  # px


class SceneTable(Table):
    """What stands around the arms."""

    model: Path | None = None  # MJCF of floor, walls, lights; a plain floor and a lamp if absent
    light: Annotated[float, Field(ge=0, le=2)] = 1.0  # brightness of every lamp


class CollisionTable(Table):
    """What the task's arm must not touch: the law keeps a distance, the guard brakes before."""

    avoid: Annotated[
        tuple[Literal["self", "arms", "fixtures", "target"], ...], Field(max_length=4)
    ] = ("self", "arms", "fixtures")  # its own links, other arms, the scene; a stationary target
    margin_m: Annotated[float, Field(ge=1e-3, le=1)] = (
        0.01  # kept by the law's limit "collision"; the guard brakes at half of it
    )


class ArmTable(Placement):
    """An arm; its placement is that of its base in the world."""

    model: Path  # MJCF or URDF; package:NAME/PATH in an installed package, see `locate_model`
    body: Text  # the last body: cameras are mounted on it unless they name another
    start_deg: _Joints  # at the start; metres for sliding joints
    rate_max_deg_s: _JointRates | None = (
        None  # m/s for sliding joints; if absent the model's limits, without those 180 or 0.5
    )
    acceleration_max_deg_s2: _JointRates | None = (
        None  # m/s² for sliding joints; 720 or 2 if absent
    )
    servo_bandwidth_hz: Rate = 12.0  # of the joint servos that stand for the robot's own
    motion: Part = None  # what it does by itself; without one the loop holds it


class DepthTable(Table):
    """What a camera measures of depth, at each pixel of its image."""

    noise_m: Distance = 0.002  # standard deviation at 1 m, in simulation; grows with the square
    range_m: tuple[Length, Length] = (0.15, 6.0)  # nearest and farthest that is measured
    holes: Annotated[float, Field(ge=0, le=1)] = 0.0  # share of the image without, in simulation

    @field_validator("range_m")
    @classmethod
    def _nearest_first(cls, interval: tuple[float, float]) -> tuple[float, float]:
        if interval[1] <= interval[0]:
            raise ValueError("[nearest, farthest]")
        return interval


class CameraTable(Placement):
    """A camera; its placement is in the body that carries it, or in the world."""

    arm: Text | None = None  # the arm that carries it; fixed in the world if absent
    body: Text | None = None  # which body of that arm; its last if absent
    radius_m: Length | None = (
        None  # of a ball around it that must touch nothing; if absent only its arm must not
    )
    resolution: tuple[_Side, _Side] = (640, 480)  # width and height of the image
    focal_mm: _Lens | None = None  # of the lens, with pixel_um
    pixel_um: tuple[_Lens, _Lens] | None = None  # width and height of a pixel
    focal_px: tuple[_Focal, _Focal] | None = None  # instead of focal_mm and pixel_um
    principal_px: Point2 | None = None  # the middle of the image if absent
    distortion: tuple[Annotated[float, Field(ge=-1e4, le=1e4)], ...] = Field(
        default=(), max_length=5
    )  # k1, k2, p1, p2, k3 of OpenCV
    calibration: Path | None = None  # a camera file, also ROS's, for the six keys above
    rate_hz: Rate = 30.0  # images per second
    latency_frames: Annotated[int, Field(ge=0, le=1000)] = (
        0  # from exposure until the image arrives
    )
    depth: DepthTable | None = None  # of a depth camera; see `law.depth`
    noise_grey: Annotated[float, Field(ge=0, le=255)] = 1.0  # standard deviation, of 255
    blind_s: Annotated[
        tuple[tuple[Time, Time], ...], Field(max_length=1000)
    ] = ()  # from when to when its images are black
    calibration_error_m: Distance = 0.0  # of its placement, in simulation
    calibration_error_deg: _Angle = 0.0  # and of its angles

    @model_validator(mode="after")
    def _one_lens(self) -> "CameraTable":
        by_lens = self.focal_mm is not None and self.pixel_um is not None
        if by_lens == (self.focal_px is not None):
            raise ValueError("either focal_mm and pixel_um, or focal_px, or calibration")
        return self

    @field_validator("blind_s")
    @classmethod
    def _forwards(
        cls, intervals: tuple[tuple[float, float], ...]
    ) -> tuple[tuple[float, float], ...]:
        if any(end <= begin for begin, end in intervals):
            raise ValueError("[from, to] of each, from before to")
        return intervals


def _kind(motion: Any) -> Any:
    """Return the kind of a motion, also while it is the name or the table of one."""
    if isinstance(motion, Mapping):
        return motion.get("kind")
    return motion if isinstance(motion, str) else kind_of(motion)


class TargetTable(Placement):
    """The object; its placement is where its motion starts, or its pose in what carries it."""

    model: Path  # MJCF or URDF
    carried_by: Text | None = None  # an arm, whose last body it is fixed to
    motion: Part = "stationary"  # what it does by itself
    features: _Features | None = None  # m, in the target; picked in the image if absent

    @model_validator(mode="after")
    def _moved_once(self) -> "TargetTable":
        if self.carried_by is not None and _kind(self.motion) != "stationary":
            raise ValueError("either carried_by or a motion of its own")
        return self


class ToolTable(Placement):
    """What the arm holds beside its camera; its placement is in the arm's last body."""

    model: Path  # MJCF
    camera: Text  # the fixed one that looks at it
    features: tuple[Vector3, ...] = Field(
        min_length=1, max_length=MOST_POINTS
    )  # x, y, z of each, in the tool
    desired: _Desired = "initial"  # in that camera, as for the task


class TrackTable(TaskTable):
    """Keep features where they are desired in one camera's image."""

    kind: Literal["track"] = "track"
    arm: Text  # which moves, or carries the target
    camera: Text  # carried by the arm, or fixed
    feature_count: Annotated[int, Field(ge=1, le=64)] = 1  # how many to pick, if they are picked
    points_px: Annotated[tuple[Point2, ...], Field(max_length=MOST_POINTS)] | None = (
        None  # (u, v) of the features in the first image; found by the target's placement if absent
    )
    desired: _Desired = (
        "initial"  # as at the start, or their middle in the image's, or (u, v) of each in pixels
    )
    tracker: Part = "ssd"  # what follows the features from image to image
    approach: Literal["direct", "auto"] = (
        "direct"  # auto: along a planned path to stated `desired` points, where they can be planned
    )
    tool: ToolTable | None = None  # to be kept in its place before a second, fixed camera
    tolerance_px: Pixels = 1.0  # mean error above which an arm at rest has not reached its goal
    image_timeout_s: Duration = 0.5  # without an image for so long, the run ends
    target_timeout_s: Duration = 0.2  # with images, but none of the features found


class FollowTable(TaskTable):
    """Keep a camera on the arm, or what the arm holds before a fixed one, at a desired pose."""

    kind: Literal["follow"]
    arm: Text  # which moves
    camera: Text  # carried by the arm, or fixed where the arm carries the target
    desired: Literal["initial"] | Placement = "initial"  # the target's pose in that camera
    image_timeout_s: Duration = 0.5  # without an image for so long, the run ends
    target_timeout_s: Duration = 2.0  # with images, but the target lost


class LengthTable(Table):
    """How far two points are apart that a photograph shows."""

    points_px: tuple[Point2, Point2]  # (u, v) of both, in the photograph
    length_m: Length  # between them

    @model_validator(mode="after")
    def _apart(self) -> "LengthTable":
        if max(abs(a - b) for a, b in zip(*self.points_px, strict=True)) < 5.0:
            raise ValueError("two points at least 5 pixels apart")
        return self


class ReachTable(TaskTable):
    """Bring the camera to where the target looks as in an image taken before, along a plan."""

    kind: Literal["reach"]
    arm: Text  # which moves
    camera: Text  # carried by the arm
    goal: Path | None = None  # a photograph of what to see; beside it may lie NAME.camera.yaml
    goal_deg: _Joints | None = (
        None  # joints when it was taken; metres if they slide; a simulation can take it there
    )
    distance_m: Length | None = (
        None  # rough distance of that camera from what it sees; the arm's motion tells it as well
    )
    length: LengthTable | None = None  # a known length in the photograph, for the scale
    matcher: Part = "sift"  # what recognises the photograph
    tolerance_m: Length = 1e-3  # distance from the goal at which it is reached, for sure
    tolerance_deg: Annotated[float, Field(gt=0, le=180)] = 0.2  # and angle
    planner: Part = "optimised"  # of the path in the image: or the paper's, or one's own
    tracker: Part = "round_marks"  # what follows the features from image to image
    margin_px: Pixels = 10.0  # kept from the border of the image
    margin_joint: Annotated[float, Field(ge=0, lt=0.5)] = 0.01  # of half a joint's range
    camera_speed_m_s: Speed = 0.25  # on the way
    tolerance_px: Pixels = 1.0  # mean error of the farthest feature up to which it is reached
    image_timeout_s: Duration = 0.5  # without an image for so long, the run ends
    target_timeout_s: Duration = 0.5  # with images, but the target lost


class AdvanceTable(TaskTable):
    """Move the camera, or what the arm holds before a fixed one, along an axis, without images."""

    kind: Literal["advance"]
    arm: Text  # which moves
    camera: Text  # carried by the arm, or fixed
    distance_m: Coordinate  # from where it is; negative for backwards
    axis: Literal["x", "y", "z"] = "z"  # which way
    frame: Literal["camera", "flange", "world"] = (
        "camera"  # whose axis, as it is at the start; flange is the arm's last body
    )
    speed_m_s: Speed = 0.1  # at most
    tolerance_m: Length = 2e-3  # distance from the end at which it is reached
    image_timeout_s: Duration = 0.5  # without an image for so long, the run ends

    @field_validator("distance_m")
    @classmethod
    def _some(cls, distance_m: float) -> float:
        if abs(distance_m) < 1e-4:
            raise ValueError("a distance of at least 0.0001 m, either way")
        return distance_m


class SwitchTable(TaskTable):
    """Switch an output of the driver, such as a gripper, while the arm stays where it is."""

    kind: Literal["switch"]
    arm: Text  # which stays
    camera: Text  # of the other tasks
    output: Text  # one of [outputs]
    value: Annotated[float, Field(ge=0, le=1)]  # 0 is off or open, 1 is on or closed
    wait_s: Duration = 0.5  # until it has done what it does
    image_timeout_s: Duration = 0.5  # without an image for so long, the run ends


class OutputTable(Placement):
    """An output of the driver, such as a gripper; its placement is in the arm's last body."""

    arm: Text  # that carries it
    model: Path | None = None  # MJCF of what it looks like; nothing is drawn if absent
    reach_m: Length = (
        0.02  # in simulation, closed it holds a target whose origin is so near, rigidly
    )


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


class PerceptionTable(Table):
    """How the target's pose is estimated, where the task needs it."""

    cameras: Annotated[tuple[Name, ...], Field(max_length=64)] | None = (
        None  # those that are looked through; all if absent
    )
    filter: Part = "pose"  # on SE(3), or the roll-pitch-yaw state of the paper, or one's own
    selection: Literal["information", "indexes"] = (
        "information"  # of features: or by spread, as [Lippiello2005]
    )
    budget: Annotated[int, Field(ge=3, le=4096)] = 16  # features measured a tick, over all cameras
    noise_px: _Noise = 0.5  # expected of a measured point; drawn where there are no images
    believed_noise_px: _Noise | None = None  # in place of what each measurement says of itself
    outliers: Annotated[float, Field(ge=0, lt=1)] = 0.0  # share of wrong matches made on purpose
    occlusion: bool = True  # whether arms and fixtures in the way are predicted
    start_error_m: Distance | None = (
        None  # how well the target's placement is known: 0.01 to follow, else 0
    )
    start_error_deg: _Angle | None = None  # and its angle: 2 to follow


class DriverTable(Table):
    """The real robot of the cell, for `--driver`; its other keys are the settings of its kind."""

    model_config = ConfigDict(extra="allow")

    kind: Text  # a driver, or module:Class of your own; used where `--driver` names it
    stamp_latency_s: dict[Name, Annotated[float, Field(ge=-0.1, le=2)]] = Field(
        default_factory=dict, max_length=32
    )  # by camera name: how much later than exposed its images are stamped; see `calibrate`
    servo_lag_s: Annotated[float, Field(ge=0, le=1)] = (
        0.0  # by which the joints follow their set-points; see `vergence calibrate --latency`
    )
    cameras: dict[Name, Part] = Field(
        default_factory=dict, max_length=32
    )  # by camera name: a source of its images on this computer
