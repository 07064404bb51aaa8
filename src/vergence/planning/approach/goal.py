"""The goal of an approach, and its settings."""

from dataclasses import dataclass
from typing import Any, NamedTuple, Self

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.camera import Camera
from vergence.vision.matching import Matcher


class GoalImage(NamedTuple):
    """A photograph as the arm's camera would have taken it, and its description for the matcher."""

    image: ImageArray  # (height, width) grey
    camera: Camera  # the arm's
    matcher: Matcher
    described: Any  # keypoints and descriptors of the matcher
    mask: BoolArray | None = None  # (height, width) where the photograph shows something

    @classmethod
    def of(
        cls, image: ImageArray, camera: Camera, matcher: Matcher, mask: BoolArray | None = None
    ) -> Self:
        """Describe a photograph."""
        return cls(image, camera, matcher, matcher.describe(image, mask), mask)


class KnownLength(NamedTuple):
    """The known distance between two points in the photograph."""

    points_px: FloatArray  # (2, 2) in the photograph
    length_m: float


@dataclass(frozen=True, slots=True)
class ApproachSettings:
    """Settings of an approach to a photograph."""

    tolerance_m: float = 1e-3  # distance from the goal that the confidence region must be within
    tolerance_rad: float = 0.0035  # angle likewise
    distance_m: float | None = None  # rough distance from camera to object at the goal
    length: KnownLength | None = None  # in the photograph
    margin_px: float = 10.0  # distance to keep from the border of the image
    # Distance to keep from joint limits, as a fraction of half the range.
    margin_joint: float = 0.01
    camera_speed_m_s: float = 0.25  # on the path
    points: int = 16  # number of tracked points
    luminance: bool = False  # whether the grey values of the whole image finish the path
