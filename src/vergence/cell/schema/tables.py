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
from vergence.cell.schema.imaging import Imaging
from vergence.cell.schema.tag import TagTable
from vergence.errors import NOTHING, InputError
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
_ExactNoise = Annotated[float, Field(ge=0, le=100)]  # px, of projections


class SceneTable(Table):
    """Surroundings of the arms."""

    # MJCF file of floor, walls and lights; a plain floor and a lamp if absent.
    model: Path | None = None
    light: Annotated[float, Field(ge=0, le=2)] = 1.0  # brightness of all lamps


class CollisionTable(Table):
    """Collision avoidance of the task's arm, by the law and, as a last resort, the guard."""

    # The arm's own links, other arms, the scene; or a stationary target.
    avoid: Annotated[
        tuple[Literal["self", "arms", "fixtures", "target"], ...], Field(max_length=4)
    ] = ("self", "arms", "fixtures")
    # Distance kept by the law's limit "collision"; the guard brakes at half of it.
    margin_m: Annotated[float, Field(ge=1e-3, le=1)] = 0.01


class ArmTable(Placement):
    """An arm; its placement is that of its base in the world."""

    model: Path  # MJCF or URDF; package:NAME/PATH in an installed package, see `locate_model`
    body: Text  # last body of the arm; cameras are mounted on it unless they name another
    start_deg: _Joints  # initial joint positions; m for prismatic joints
    # Rate limits, m/s for prismatic joints; default: the model's, or else 180 or 0.5.
    rate_max_deg_s: _JointRates | None = None
    # Acceleration limits, m/s² for prismatic joints; 720 or 2 if absent.
    acceleration_max_deg_s2: _JointRates | None = None
    servo_bandwidth_hz: Rate = 12.0  # bandwidth of the joint servos that model those of the robot
    motion: Part = None  # motion of its own; without one the loop holds it


class DepthTable(Table):
    """The depth that a camera measures at each pixel of its image."""

    # Standard deviation at 1 m, in simulation; it grows with the square of the distance.
    noise_m: Distance = 0.002
    range_m: tuple[Length, Length] = (0.15, 6.0)  # smallest and largest depth that is measured
    # Fraction of the image without a depth, in simulation.
    holes: Annotated[float, Field(ge=0, le=1)] = 0.0

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
    # Radius of a sphere around it that must touch nothing; if absent, only its arm is checked.
    radius_m: Length | None = None
    resolution: tuple[_Side, _Side] = (640, 480)  # width and height of the image
    focal_mm: _Lens | None = None  # focal length of the lens; needs pixel_um
    pixel_um: tuple[_Lens, _Lens] | None = None  # width and height of a pixel
    focal_px: tuple[_Focal, _Focal] | None = None  # focal lengths fx, fy; instead of the two above
    principal_px: Point2 | None = None  # principal point cx, cy; the image's middle if absent
    # Coefficients k1, k2, p1, p2, k3 of OpenCV.
    distortion: tuple[Annotated[float, Field(ge=-1e4, le=1e4)], ...] = Field(
        default=(), max_length=5
    )
    # Camera file, also in ROS's format; instead of the six keys above.
    calibration: Path | None = None
    rate_hz: Rate = 30.0  # images per second
    # Delay from exposure to arrival, in frames.
    latency_frames: Annotated[int, Field(ge=0, le=1000)] = 0
    depth: DepthTable | None = None  # settings of a depth camera; see `law.depth`
    noise_grey: Annotated[float, Field(ge=0, le=255)] = (
        1.0  # noise of a pixel, in grey levels of 255
    )
    # How its images differ from ideal ones, in simulation: a table, or "real_camera".
    imaging: Imaging | None = None
    # Intervals [start, end] in which its images are black, in simulation.
    blind_s: Annotated[tuple[tuple[Time, Time], ...], Field(max_length=1000)] = ()
    calibration_error_m: Distance = 0.0  # error of its position, in simulation
    calibration_error_deg: _Angle = 0.0  # error of its orientation, in simulation

    @model_validator(mode="after")
    def _one_lens(self) -> "CameraTable":
        by_lens = self.focal_mm is not None and self.pixel_um is not None
        if by_lens == (self.focal_px is not None):
            raise ValueError("either focal_mm and pixel_um, or focal_px, or calibration")
        return self

    @model_validator(mode="after")
    def _open_for_a_period(self) -> "CameraTable":
        for key in ("exposure_s", "readout_s"):
            given = getattr(self.imaging, key, 0.0)
            if given * self.rate_hz > 1.0 + 1e-9:
                allowed = f"at most {1.0 / self.rate_hz:.4g}, the time between images"
                raise InputError("", f"imaging.{key}", given, allowed)
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
    """The object; its placement is where it starts, or its pose in the body that carries it."""

    model: Path | None = None  # MJCF or URDF; a plate that shows the tag if absent
    tag: TagTable | None = None  # marker that it carries
    carried_by: Text | None = None  # arm to whose last body it is attached
    motion: Part = "stationary"  # motion of its own
    # Points in the target's frame, in m; the corners of its tag, or picked in the first image, if
    # absent.
    features: _Features | None = None

    @model_validator(mode="after")
    def _shown(self) -> "TargetTable":
        if self.model is None and self.tag is None:
            raise InputError("", "model", NOTHING, "a value, or a tag")
        if self.tag is not None:
            object.__setattr__(self, "features", self.tag.corners)
        return self

    @model_validator(mode="after")
    def _moved_once(self) -> "TargetTable":
        if self.carried_by is not None and _kind(self.motion) != "stationary":
            raise ValueError("either carried_by or a motion of its own")
        return self


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
    goal_deg: _Joints | None = None
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


class OutputTable(Placement):
    """An output of the driver, such as a gripper; its placement is in the arm's last body."""

    arm: Text  # arm that carries it
    model: Path | None = None  # MJCF of what it looks like; nothing is drawn if absent
    # In simulation, a closed gripper rigidly holds a target whose origin is within this distance.
    reach_m: Length = 0.02


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
    """How the target's pose is estimated, if the task needs it."""

    # Cameras to use; all if absent.
    cameras: Annotated[tuple[Name, ...], Field(max_length=64)] | None = None
    filter: Part = "pose"  # pose filter: on SE(3), or with the paper's roll-pitch-yaw state
    # Selection of features by information, or by distribution as in [Lippiello2005].
    selection: Literal["information", "indexes"] = "information"
    # Features measured per tick, over all cameras.
    budget: Annotated[int, Field(ge=3, le=4096)] = 16
    border_px: Pixels = 8.0  # distance of chosen features from the border of an image
    # Least distance between features chosen in one image; 0 for any.
    feature_distance_px: Annotated[float, Field(ge=0, le=1000)] = 0.0
    # Standard deviation of a measured point; also simulated if no images are rendered.
    noise_px: _Noise = 0.5
    # Standard deviation that the filter uses instead of that stated by each measurement.
    believed_noise_px: _Noise | None = None
    outliers: Annotated[float, Field(ge=0, lt=1)] = 0.0  # fraction of wrong matches to simulate
    occlusion: bool = True  # whether to predict occlusion by arms and fixtures
    # Uncertainty of the target's initial position; default 0.01 for follow, else 0.
    start_error_m: Distance | None = None
    # Uncertainty of its initial orientation; default 2 for follow, else 0.
    start_error_deg: _Angle | None = None


class DriverTable(Table):
    """The real robot of the cell, for `--driver`; its other keys are the settings of its kind."""

    model_config = ConfigDict(extra="allow")

    kind: Text  # driver, or module:Class of your own; used only if `--driver` names it
    # By camera name: delay of the time stamps after exposure; see `vergence calibrate --latency`.
    stamp_latency_s: dict[Name, Annotated[float, Field(ge=-0.1, le=2)]] = Field(
        default_factory=dict, max_length=32
    )
    # Delay of the joints behind their set-points; see `vergence calibrate --latency`.
    servo_lag_s: Annotated[float, Field(ge=0, le=1)] = 0.0
    # By camera name: source of its images on this computer.
    cameras: dict[Name, Part] = Field(default_factory=dict, max_length=32)
