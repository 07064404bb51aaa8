"""Arms, cameras, target, task and perception in a cell file."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from vergence.cell.schema.base import Placement, Positive, Table, Vector3

_Side = Annotated[int, Field(ge=16)]


class SceneTable(Table):
    """What stands around the arms."""

    model: Path | None = None  # MJCF of floor, walls, lights; a plain floor and a lamp if absent
    light: Annotated[float, Field(ge=0, le=2)] = 1.0  # brightness of every lamp


class Waypoints(Table):
    """Way-points of a motion of its own, with rest at each and minimum jerk between them."""

    times_s: tuple[Annotated[float, Field(ge=0)], ...] = Field(min_length=2)  # first 0, increasing
    speed: Positive = 1.0  # the times are divided by it

    @model_validator(mode="after")
    def _one_each(self) -> "Waypoints":
        if self.times_s[0] != 0 or any(
            b <= a for a, b in zip(self.times_s, self.times_s[1:], strict=False)
        ):
            raise ValueError("times_s that begin with 0 and increase")
        for name, value in self:
            if isinstance(value, tuple) and len(value) != len(self.times_s):
                raise ValueError(f"as many {name} as times_s")
        return self


class JointMotion(Waypoints):
    """The arm moves its joints through way-points, relative to its start."""

    kind: Literal["joints"]
    offsets_deg: tuple[tuple[float, ...], ...]  # metres for sliding joints


class PoseMotion(Waypoints):
    """An arm moves its last body, or the target it carries; or a target moves by itself.

    A way-point is the pose in the frame that the body or target had at the start.
    """

    kind: Literal["poses"]
    positions_m: tuple[Vector3, ...]  # one for each time
    rotations_rpy_deg: tuple[Vector3, ...]  # one for each time


ArmMotion = Annotated[JointMotion | PoseMotion, Field(discriminator="kind")]


class ArmTable(Placement):
    """An arm; its placement is that of its base in the world."""

    model: Path  # MJCF or URDF; package:NAME/PATH in an installed package, see `locate_model`
    body: str  # the last body: cameras are mounted on it unless they name another
    start_deg: tuple[float, ...]  # at the start: degrees; metres for sliding joints
    rate_max_deg_s: Positive | tuple[Positive, ...] = 180.0  # m/s·(180/π) for sliding joints
    acceleration_max_deg_s2: Positive | tuple[Positive, ...] = 720.0  # m/s²·(180/π) if they slide
    servo_bandwidth_hz: Positive = 12.0  # of the joint servos that stand for the robot's own
    motion: ArmMotion | None = None  # what it does by itself; without one the loop holds it


class CameraTable(Placement):
    """A camera; its placement is in the body that carries it, or in the world."""

    arm: str | None = None  # the arm that carries it; fixed in the world if absent
    body: str | None = None  # which body of that arm; its last if absent
    resolution: tuple[_Side, _Side] = (640, 480)  # width and height of the picture
    focal_mm: Positive | None = None  # of the lens, with pixel_um
    pixel_um: tuple[Positive, Positive] | None = None  # width and height of a pixel
    focal_px: tuple[Positive, Positive] | None = None  # instead of focal_mm and pixel_um
    principal_px: tuple[float, float] | None = None  # the middle of the image if absent
    distortion: tuple[float, ...] = Field(default=(), max_length=5)  # k1, k2, p1, p2, k3 of OpenCV
    calibration: Path | None = None  # a camera file, also ROS's, for the six keys above
    rate_hz: Positive = 30.0  # pictures a second
    latency_frames: Annotated[int, Field(ge=0)] = 0  # from exposure until the picture arrives
    noise_grey: Annotated[float, Field(ge=0)] = 1.0  # standard deviation, of 255
    blind_s: tuple[tuple[float, float], ...] = ()  # from when to when its pictures are black
    calibration_error_m: Annotated[float, Field(ge=0)] = 0.0  # how far its believed pose is off
    calibration_error_deg: Annotated[float, Field(ge=0)] = 0.0  # and by what angle

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


class StillMotion(Table):
    """The target stands."""

    kind: Literal["still"] = "still"


class LineMotion(Table):
    """The target moves along a line, then stands."""

    kind: Literal["line"]
    velocity_m_s: Vector3  # in the world
    distance_m: Positive  # after which it stops
    start_s: Annotated[float, Field(ge=0)] = 0.0  # stands until then


class CircleMotion(Table):
    """The target moves on a horizontal circle that starts at its placement."""

    kind: Literal["circle"]
    radius_m: Positive  # of the circle
    period_s: Positive  # of once around
    start_s: Annotated[float, Field(ge=0)] = 0.0  # stands until then


class StepMotion(Table):
    """The target jumps."""

    kind: Literal["step"]
    offset_m: Vector3  # in the world
    time_s: Annotated[float, Field(ge=0)]  # when


class RandomMotion(Table):
    """The target wanders smoothly: a few sinusoids of random phase on every axis."""

    kind: Literal["random"]
    amplitude_m: Vector3  # along the world's axes
    amplitude_rpy_deg: Vector3 = (0.0, 0.0, 0.0)  # about them
    fastest_hz: Positive = 0.3  # of the sinusoids
    start_s: Annotated[float, Field(ge=0)] = 0.0  # stands until then


Motion = Annotated[
    StillMotion | LineMotion | CircleMotion | StepMotion | RandomMotion | PoseMotion,
    Field(discriminator="kind"),
]


class TargetTable(Placement):
    """The object; its placement is where its motion starts, or its pose in what carries it."""

    model: Path  # MJCF or URDF
    carried_by: str | None = None  # an arm, whose last body it is fixed to
    motion: Motion = StillMotion()  # what it does by itself
    features: tuple[Vector3, ...] | None = None  # m, in the target; picked in the image if absent

    @model_validator(mode="after")
    def _moved_once(self) -> "TargetTable":
        if self.carried_by is not None and self.motion.kind != "still":
            raise ValueError("either carried_by or a motion of its own")
        return self


class ToolTable(Placement):
    """What the arm holds in its hand; its placement is in the arm's last body."""

    model: Path  # MJCF
    camera: str  # the fixed one that looks at it
    features: tuple[Vector3, ...] = Field(min_length=1)  # x, y, z of each, in the tool
    desired: Literal["initial", "centred"] | tuple[tuple[float, float], ...] = (
        "initial"  # in that camera, as for the task
    )


class TrackTable(Table):
    """Keep features where they are wanted in one camera's image."""

    kind: Literal["track"] = "track"
    arm: str  # which moves, or carries the target
    camera: str  # carried by the arm, or fixed
    feature_count: Annotated[int, Field(ge=1, le=64)] = 1  # how many to pick, if they are picked
    desired: Literal["initial", "centred"] | tuple[tuple[float, float], ...] = (
        "initial"  # as at the start, or their middle in the image's, or (u, v) of each in pixels
    )
    tool: ToolTable | None = None  # to be kept in its place before a second, fixed camera
    image_timeout_s: Positive = 0.5  # without a picture for so long, the run ends
    target_timeout_s: Positive = 0.2  # with pictures, but none of the features found


class FollowTable(Table):
    """Keep a camera in the hand, or what the hand holds before a fixed one, at a wanted pose."""

    kind: Literal["follow"]
    arm: str  # which moves
    camera: str  # carried by the arm, or fixed where the arm carries the target
    desired: Literal["initial"] | Placement = "initial"  # the target's pose in that camera
    image_timeout_s: Positive = 0.5  # without a picture for so long, the run ends
    target_timeout_s: Positive = 2.0  # with pictures, but the target lost


class ReachTable(Table):
    """Bring the camera to where the target looks as in a picture taken before, along a plan."""

    kind: Literal["reach"]
    arm: str  # which moves
    camera: str  # carried by the arm
    goal_deg: tuple[float, ...]  # joints when the desired picture was taken; metres if they slide
    distance_m: Positive  # believed distance of that camera from the reference plane, d*
    planner: Literal["optimised", "potential_field"] = "optimised"  # optimised, or the paper's
    margin_px: Annotated[float, Field(ge=0)] = 10.0  # kept from the border of the image
    margin_joint: Annotated[float, Field(ge=0, lt=0.5)] = 0.01  # of half a joint's range
    camera_speed_m_s: Positive = 0.25  # on the way
    image_timeout_s: Positive = 0.5  # without a picture for so long, the run ends
    target_timeout_s: Positive = 0.5  # with pictures, but the target lost


def _task_kind(value: Any) -> str | None:
    if isinstance(value, Table):
        return str(getattr(value, "kind", None))
    return str(value.get("kind", "track")) if isinstance(value, dict) else None


Task = Annotated[
    Annotated[TrackTable, Tag("track")]
    | Annotated[FollowTable, Tag("follow")]
    | Annotated[ReachTable, Tag("reach")],
    Discriminator(_task_kind),
]


class PerceptionTable(Table):
    """How the target's pose is estimated, where the task needs it."""

    cameras: tuple[str, ...] | None = None  # those that are looked through; all if absent
    filter: Literal["pose", "rpy"] = "pose"  # on SE(3), or the roll-pitch-yaw state of the paper
    selection: Literal["information", "indexes"] = (
        "information"  # of features: or by spread, as [Lippiello2005]
    )
    budget: Annotated[int, Field(ge=3)] = 16  # features measured a tick, over all cameras
    noise_px: Positive = 0.5  # expected of a measured point; drawn where there are no images
    believed_noise_px: Positive | None = None  # in place of what each measurement says of itself
    outliers: Annotated[float, Field(ge=0, lt=1)] = 0.0  # share of wrong matches made on purpose
    occlusion: bool = True  # whether arms and fixtures in the way are predicted
    start_error_m: Annotated[float, Field(ge=0)] = 0.01  # how well the first pose is known
    start_error_deg: Annotated[float, Field(ge=0)] = 2.0  # and its angle
    acceleration_density: Positive = 0.01  # m²/s³, of the target, for the filter on SE(3)
    angular_acceleration_density: Positive = 0.25  # rad²/s³
