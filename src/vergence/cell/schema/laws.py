"""The laws of a cell file."""

from typing import Annotated, Literal

from pydantic import Field

from vergence.cell.schema.base import (
    Axis,
    Distance,
    Gain,
    Length,
    OptionalWeight,
    Pixels,
    Rate,
    SingularValue,
    Speed,
    Table,
    Weight,
)

Axes = Annotated[tuple[Axis, ...], Field(min_length=1, max_length=6)]
Weights = Weight | Annotated[tuple[Weight, ...], Field(max_length=12)]
Smoothing = Annotated[float, Field(ge=0, le=100)]  # s
Order = tuple[Literal["view", "occlusion", "singularity", "joint margin"], ...]


class OptimalTrackingTable(Table):
    """The law of [Nelson1995] eq. (29), its gains in the paper's units (pixels, metres a frame)."""

    kind: Literal["optimal_tracking"]
    axes: Axes = ("x", "y", "z", "rx", "ry", "rz")  # of the camera, that track
    avoidance_axes: Annotated[
        tuple[Axis, ...], Field(max_length=6)
    ] = ()  # of the camera, that avoid limits
    Q: Weight = 2e-6  # 1/px², shared by the features
    R: Weights = 10.0  # one for all controlled axes, or one each
    S: OptionalWeight = 0.0  # weight of 1/w', w' the penalised manipulability
    penalty: Literal["product", "per_joint"] = "product"  # of joint limits, as printed or by joint
    penalty_k: Weight = 1e5  # k of the penalty as printed
    depth_m: Length | Literal["initial"] = "initial"  # what the start shows, held constant
    avoidance_speed_max_m_s: Speed = 0.5  # of the camera, for avoidance
    singular_below: Annotated[float, Field(gt=0, le=10)] = (
        0.02  # smallest singular value of J at which the law gives up
    )
    flow_smoothing_s: Smoothing | None = None  # the target stands if absent


Objective = Literal["image_based", "optimal_tracking", "position_based"]


class PoseTrajectoryTable(Table):
    """How a hand gets from where it is to where the target wants it, between pictures."""

    filter_hz: Rate = 5.0  # natural frequency of the second-order interpolating filter
    damping: Gain = 1.0  # of that filter
    feed_forward: bool = True  # the target's velocity goes through to the hand
    prediction: bool = True  # the target's pose is predicted from the exposure to now
    closed_loop_hz: Rate = 5.0  # how fast the joints make up for what they are behind
    null_space: Annotated[float, Field(ge=0, le=1e3)] = (
        0.5  # 1/s, pull of spare joints to mid-range
    )


class PositionBasedTable(PoseTrajectoryTable):
    """The target's pose and a wanted relative pose make the hand's trajectory."""

    kind: Literal["position_based"]
    singular_below: SingularValue = 0.02  # damping below it, of the largest value


class ImageObjectiveTable(Table):
    """What the camera should do about features in the image."""

    gain: Gain = 1.0  # λ of image_based, 1/s
    interaction: Literal["current", "desired", "mean"] = "current"  # where image_based takes L
    axes: Axes = ("x", "y", "z", "rx", "ry", "rz")  # of optimal_tracking
    Q: Weight = 2e-6  # of optimal_tracking, 1/px², shared by the features
    R: Weights = 1.0  # of optimal_tracking, one for all axes, or one each
    depth_m: Length | Literal["initial"] = "initial"  # believed of the features at the start
    carries_depth: bool = False  # on by the camera's motion, if the target stands; else held


class ConstrainedTable(ImageObjectiveTable, PoseTrajectoryTable):
    """Any objective under hard joint limits, with view, sight and singularities kept."""

    kind: Literal["constrained"]
    objective: Objective | None = None  # position_based to follow, else image_based
    S: OptionalWeight = 0.0  # on 1/w', the penalty taken joint by joint
    depth_range: tuple[Gain, Gain] | None = None  # of depths: [0.5, 2]; with a filter [0.9, 1.1]
    order: Annotated[Order, Field(max_length=4)] = (
        "view",
        "occlusion",
        "singularity",
        "joint margin",
    )  # what is kept, most important first; joint limits always are
    view_margin_px: Pixels | None = None  # 10, or half a plan's
    clearance_m: Distance = 0.02  # of sight lines from what stands about
    joint_margin: Annotated[float, Field(ge=0, lt=0.5)] | None = (
        None  # of a range: 0.03, or half a plan's
    )
    manipulability_share: Annotated[float, Field(ge=0, lt=1)] = 0.2  # of √det(J Jᵀ) at the start
    approach_rate_hz: Rate = 2.0  # share of the room to a border used up in a second
    flow_smoothing_s: Smoothing = 0.1  # of the target's motion in the image


class PlainTable(ImageObjectiveTable):
    """Any objective in the image by itself, through the inverse of the Jacobian: no limits kept."""

    kind: Literal["plain"]
    objective: Literal["image_based", "optimal_tracking"] = "image_based"  # what is minimised
    flow_smoothing_s: Smoothing | None = None  # the target stands if absent
    singular_below: SingularValue = 0.02  # where the law gives up


class PathTrackingTable(Table):
    """The law of [Mezouar2001] section 5: keeps image points on a planned trajectory."""

    kind: Literal["path_tracking"]
    gain: Gain = 2.0  # λ, 1/s
    interaction: Literal["current", "desired", "mean"] = "desired"  # where L is taken
    flow_smoothing_s: Smoothing | None = None  # the object stands if absent


Law = Annotated[
    OptimalTrackingTable | PositionBasedTable | ConstrainedTable | PlainTable | PathTrackingTable,
    Field(discriminator="kind"),
]
