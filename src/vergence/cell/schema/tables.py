"""Scene, arms, target, outputs, perception and robot in a cell file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, model_validator

from vergence.cell.schema.base import (
    MOST_JOINTS,
    MOST_POINTS,
    Distance,
    HalfTurn,
    JointRate,
    Joints,
    Length,
    Name,
    Part,
    Pixels,
    Placement,
    Rate,
    Table,
    Text,
    Vector3,
)
from vergence.cell.schema.tag import TagTable
from vergence.errors import NOTHING, InputError
from vergence.parts import kind_of

_JointRates = JointRate | Annotated[tuple[JointRate, ...], Field(max_length=MOST_JOINTS)]
_Features = Annotated[tuple[Vector3, ...], Field(max_length=MOST_POINTS)]
_Noise = Annotated[float, Field(ge=1e-4, le=100)]  # px


class SceneTable(Table):
    """Surroundings of the arms."""

    # MJCF file of floor, walls, lights and sky; a plain floor, lamps and a sky if absent.
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

    model: Path  # MJCF or URDF; `package:NAME/PATH` in an installed package
    body: Text  # last body of the arm; cameras are mounted on it unless they name another
    start_deg: Joints  # initial joint positions; m for prismatic joints
    # Rate limits, m/s for prismatic joints; default: the model's, or else 180 or 0.5.
    rate_max_deg_s: _JointRates | None = None
    # Acceleration limits, m/s² for prismatic joints; 720 or 2 if absent.
    acceleration_max_deg_s2: _JointRates | None = None
    servo_bandwidth_hz: Rate = 12.0  # bandwidth of the joint servos that model those of the robot
    motion: Part = None  # motion of its own; without one the loop holds it


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


class OutputTable(Placement):
    """An output of the driver, such as a gripper; its placement is in the arm's last body."""

    arm: Text  # arm that carries it
    model: Path | None = None  # MJCF of what it looks like; nothing is drawn if absent
    # In simulation, a closed gripper rigidly holds a target whose origin is within this distance.
    reach_m: Length = 0.02


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
    start_error_deg: HalfTurn | None = None


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
