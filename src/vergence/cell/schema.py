"""The tables of a cell file, typed."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

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


class ArmTable(Placement):
    """An arm; its placement is that of its base in the world."""

    model: Path  # MJCF or URDF
    body: str  # the last body: cameras are mounted on it unless they name another
    start_deg: tuple[float, ...]  # at the start: degrees; metres for sliding joints
    rate_max_deg_s: Positive | tuple[Positive, ...] = 180.0  # m/s·(180/π) for sliding joints
    acceleration_max_deg_s2: Positive | tuple[Positive, ...] = 720.0
    servo_bandwidth_hz: Positive = 12.0  # of the joint servos that stand for the robot's own


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
    StillMotion | LineMotion | CircleMotion | StepMotion | RandomMotion,
    Field(discriminator="kind"),
]


class TargetTable(Placement):
    """The object; its placement is where its motion starts."""

    model: Path
    motion: Motion = StillMotion()
    features: tuple[Vector3, ...] | None = None  # m, in the target; picked in the image if absent


class TaskTable(Table):
    """What the arm shall do."""

    kind: Literal["track"] = "track"
    arm: str
    camera: str
    feature_count: Annotated[int, Field(ge=1, le=64)] = 1  # how many to pick, if they are picked
    desired: Literal["initial", "centred"] | tuple[tuple[float, float], ...] = "initial"
    image_timeout_s: Positive = 0.5  # without a picture for so long, the run ends


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


Law = Annotated[OptimalTrackingTable, Field()]
