"""The tables of a cell file, typed."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

Vector3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
Axis = Literal["x", "y", "z", "rx", "ry", "rz"]


class Table(BaseModel):
    """A table of the file: unknown keys are mistakes, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Placement(Table):
    """A pose: a position and roll-pitch-yaw angles, R = Rz(yaw) Ry(pitch) Rx(roll)."""

    position_m: Vector3 = (0.0, 0.0, 0.0)
    rotation_rpy_deg: Vector3 = (0.0, 0.0, 0.0)


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
    positions_m: tuple[Vector3, ...]
    rotations_rpy_deg: tuple[Vector3, ...]


ArmMotion = Annotated[JointMotion | PoseMotion, Field(discriminator="kind")]


class ArmTable(Placement):
    """An arm; its placement is that of its base in the world."""

    model: Path  # MJCF or URDF
    body: str  # the last body: cameras are mounted on it unless they name another
    start_deg: tuple[float, ...]  # at the start: degrees; metres for sliding joints
    rate_max_deg_s: Positive | tuple[Positive, ...] = 180.0  # m/s·(180/π) for sliding joints
    acceleration_max_deg_s2: Positive | tuple[Positive, ...] = 720.0
    servo_bandwidth_hz: Positive = 12.0  # of the joint servos that stand for the robot's own
    motion: ArmMotion | None = None  # what it does by itself; without one the loop holds it


class CameraTable(Placement):
    """A camera; its placement is in the body that carries it, or in the world."""

    arm: str | None = None  # the arm that carries it; fixed in the world if absent
    body: str | None = None  # which body of that arm; its last if absent
    resolution: tuple[Annotated[int, Field(ge=16)], Annotated[int, Field(ge=16)]] = (640, 480)
    focal_mm: Positive | None = None
    pixel_um: tuple[Positive, Positive] | None = None
    focal_px: tuple[Positive, Positive] | None = None
    principal_px: tuple[float, float] | None = None  # the middle of the image if absent
    rate_hz: Positive = 30.0
    latency_frames: Annotated[int, Field(ge=0)] = 0  # from exposure until the picture arrives
    noise_grey: Annotated[float, Field(ge=0)] = 1.0  # standard deviation, of 255
    blind_s: tuple[tuple[float, float], ...] = ()  # from when to when its pictures are black

    @model_validator(mode="after")
    def _one_lens(self) -> "CameraTable":
        by_lens = self.focal_mm is not None and self.pixel_um is not None
        if by_lens == (self.focal_px is not None):
            raise ValueError("either focal_mm and pixel_um, or focal_px")
        return self


class StillMotion(Table):
    """The target stands."""

    kind: Literal["still"] = "still"


class LineMotion(Table):
    """The target moves along a line, then stands."""

    kind: Literal["line"]
    velocity_m_s: Vector3
    distance_m: Positive  # after which it stops
    start_s: Annotated[float, Field(ge=0)] = 0.0


class CircleMotion(Table):
    """The target moves on a horizontal circle that starts at its placement."""

    kind: Literal["circle"]
    radius_m: Positive
    period_s: Positive
    start_s: Annotated[float, Field(ge=0)] = 0.0


class StepMotion(Table):
    """The target jumps."""

    kind: Literal["step"]
    offset_m: Vector3
    time_s: Annotated[float, Field(ge=0)]


class RandomMotion(Table):
    """The target wanders smoothly: a few sinusoids of random phase on every axis."""

    kind: Literal["random"]
    amplitude_m: Vector3
    amplitude_rpy_deg: Vector3 = (0.0, 0.0, 0.0)
    fastest_hz: Positive = 0.3
    start_s: Annotated[float, Field(ge=0)] = 0.0


Motion = Annotated[
    StillMotion | LineMotion | CircleMotion | StepMotion | RandomMotion | PoseMotion,
    Field(discriminator="kind"),
]


class TargetTable(Placement):
    """The object; its placement is where its motion starts, or its pose in what carries it."""

    model: Path
    carried_by: str | None = None  # an arm, whose last body it is fixed to
    motion: Motion = StillMotion()
    features: tuple[Vector3, ...] | None = None  # m, in the target; picked in the image if absent

    @model_validator(mode="after")
    def _moved_once(self) -> "TargetTable":
        if self.carried_by is not None and self.motion.kind != "still":
            raise ValueError("either carried_by or a motion of its own")
        return self


class TrackTable(Table):
    """Keep features where they are wanted in one camera's image."""

    kind: Literal["track"] = "track"
    arm: str
    camera: str
    feature_count: Annotated[int, Field(ge=1, le=64)] = 1  # how many to pick, if they are picked
    desired: Literal["initial", "centred"] | tuple[tuple[float, float], ...] = "initial"
    image_timeout_s: Positive = 0.5  # without a picture for so long, the run ends
    target_timeout_s: Positive = 0.2  # with pictures, but none of the features found


class FollowTable(Table):
    """Keep a camera, and so the hand that carries it, at a wanted pose relative to the target."""

    kind: Literal["follow"]
    arm: str
    camera: str  # carried by the arm
    desired: Literal["initial"] | Placement = "initial"  # the target's pose in that camera
    image_timeout_s: Positive = 0.5  # without a picture for so long, the run ends
    target_timeout_s: Positive = 2.0  # with pictures, but the target lost


class ReachTable(Table):
    """Bring the camera to where the target looks as in a picture taken before, along a plan."""

    kind: Literal["reach"]
    arm: str
    camera: str
    goal_deg: tuple[float, ...]  # joints when the desired picture was taken; metres if they slide
    distance_m: Positive  # believed distance of that camera from the reference plane, d*
    planner: Literal["optimised", "potential_field"] = "optimised"
    margin_px: Annotated[float, Field(ge=0)] = 10.0  # kept from the border of the image
    margin_joint: Annotated[float, Field(ge=0, lt=0.5)] = 0.01  # of half a joint's range
    camera_speed_m_s: Positive = 0.25
    image_timeout_s: Positive = 0.5  # without a picture for so long, the run ends
    target_timeout_s: Positive = 0.5  # with pictures, but the target lost


def _task_kind(value: Any) -> str:
    kind = value.get("kind", "track") if isinstance(value, dict) else value.kind
    return str(kind)


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
    selection: Literal["information", "indexes"] = "information"
    budget: Annotated[int, Field(ge=3)] = 16  # features measured a tick, over all cameras
    noise_px: Positive = 0.5  # expected of a measured point; drawn where there are no images
    believed_noise_px: Positive | None = None  # in place of what each measurement says of itself
    outliers: Annotated[float, Field(ge=0, lt=1)] = 0.0  # share of wrong matches made on purpose
    occlusion: bool = True  # whether arms and fixtures in the way are predicted
    start_error_m: Annotated[float, Field(ge=0)] = 0.01  # how well the first pose is known
    start_error_deg: Annotated[float, Field(ge=0)] = 2.0
    acceleration_density: Positive = 0.01  # m²/s³, of the target, for the filter on SE(3)
    angular_acceleration_density: Positive = 0.25  # rad²/s³


class OptimalTrackingTable(Table):
    """The law of [Nelson1995] eq. (29), its gains in the paper's units (pixels, metres a frame)."""

    kind: Literal["optimal_tracking"]
    axes: tuple[Axis, ...] = ("x", "y", "z", "rx", "ry", "rz")
    avoidance_axes: tuple[Axis, ...] = ()
    Q: Positive = 2e-6  # 1/px²
    R: Positive | tuple[Positive, ...] = 10.0  # one for all controlled axes, or one each
    S: Annotated[float, Field(ge=0)] = 0.0
    penalty: Literal["product", "per_joint"] = "product"
    penalty_k: Positive = 1e5
    depth_m: Positive | Literal["initial"] = "initial"  # what the start shows, held constant
    avoidance_speed_max_m_s: Positive = 0.5
    singular_below: Positive = 0.02  # smallest singular value of J at which the law gives up


class PositionBasedTable(Table):
    """The target's pose and a wanted relative pose make the hand's trajectory."""

    kind: Literal["position_based"]
    filter_hz: Positive = 5.0  # natural frequency of the second-order interpolating filter
    damping: Positive = 1.0  # of that filter
    feed_forward: bool = True  # the target's velocity goes through to the hand
    prediction: bool = True  # the target's pose is predicted from the exposure to now
    closed_loop_hz: Positive = 5.0  # how fast the joints make up for what they are behind
    null_space: Annotated[float, Field(ge=0)] = 0.5  # 1/s, pull of spare joints to mid-range
    singular_below: Annotated[float, Field(ge=0)] = 0.02  # damping below it, of the largest value


class ConstrainedTable(Table):
    """Any objective in the image under hard joint limits, with view and singularities kept."""

    kind: Literal["constrained"]
    objective: Literal["image_based", "optimal_tracking"] = "image_based"
    gain: Positive = 1.0  # λ of image_based, 1/s
    interaction: Literal["current", "desired", "mean"] = "current"  # where image_based takes L
    axes: tuple[Axis, ...] = ("x", "y", "z", "rx", "ry", "rz")  # of optimal_tracking
    Q: Positive = 2e-6  # of optimal_tracking, 1/px²
    R: Positive | tuple[Positive, ...] = 1.0  # of optimal_tracking, one for all axes, or one each
    S: Annotated[float, Field(ge=0)] = 0.0  # on 1/w', the penalty taken joint by joint
    depth_m: Positive | Literal["initial"] = "initial"  # believed, held constant
    depth_range: tuple[Positive, Positive] = (0.5, 2.0)  # factors between which the truth lies
    order: tuple[Literal["view", "singularity", "joint margin"], ...] = (
        "view",
        "singularity",
        "joint margin",
    )  # what is kept, most important first; joint limits always are
    view_margin_px: Annotated[float, Field(ge=0)] = 10.0
    joint_margin: Annotated[float, Field(ge=0, lt=0.5)] = 0.03  # share of each joint's range
    manipulability_share: Annotated[float, Field(ge=0, lt=1)] = 0.2  # of √det(J Jᵀ) at the start
    approach_rate_hz: Positive = 2.0  # share of the room to a border used up in a second
    flow_smoothing_s: Annotated[float, Field(ge=0)] = 0.1  # of the target's motion in the image


class PathTrackingTable(Table):
    """The law of [Mezouar2001] section 5: keeps image points on a planned trajectory."""

    kind: Literal["path_tracking"]
    gain: Positive = 2.0  # λ, 1/s
    interaction: Literal["current", "desired", "mean"] = "desired"  # where L is taken


Law = Annotated[
    OptimalTrackingTable | PositionBasedTable | ConstrainedTable | PathTrackingTable,
    Field(discriminator="kind"),
]

# What stands at a place in the file, or is the kind of what stands there.
TABLES: dict[str, type[Table]] = {
    "scene": SceneTable,
    "arms": ArmTable,
    "joints": JointMotion,
    "poses": PoseMotion,
    "cameras": CameraTable,
    "target": TargetTable,
    "still": StillMotion,
    "line": LineMotion,
    "circle": CircleMotion,
    "step": StepMotion,
    "random": RandomMotion,
    "track": TrackTable,
    "follow": FollowTable,
    "reach": ReachTable,
    "perception": PerceptionTable,
    "optimal_tracking": OptimalTrackingTable,
    "position_based": PositionBasedTable,
    "constrained": ConstrainedTable,
    "path_tracking": PathTrackingTable,
}
