"""An image as a driver delivers it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from vergence.arrays import BoolArray, DepthArray, FloatArray, ImageArray, frozen, read_only


@dataclass(frozen=True, slots=True)
class FrameTruth:
    """What only a simulated camera knows about its image; for evaluation and exact perception."""

    T_world_target: FloatArray  # (4, 4) of what it looks at: the target, or a tool
    T_world_camera: FloatArray  # (4, 4)
    points_px: FloatArray  # (M, 2) its features, truly projected
    depth_m: FloatArray  # (M,) their depth along the optical axis
    visible: BoolArray  # (M,) in the image and in front of the camera
    others: Mapping[str, "FrameTruth"] = field(default_factory=dict)  # by name, of other targets


@dataclass(frozen=True, slots=True)
class Frame:
    """One image: when it was exposed, and where the arms were at that instant."""

    camera: str
    time: float  # s, of exposure
    image: ImageArray | None  # (height, width) grey; None from a driver that makes no images
    joints: Mapping[str, FloatArray]  # arm name to joint positions at exposure, rad or m
    truth: FrameTruth | None = None
    # (height, width) m along the optical axis at each pixel of the image, of a depth camera; what
    # is not finite or not above zero is not known.
    depth_m: DepthArray | None = None

    def __post_init__(self) -> None:
        # Read-only like every value, whoever took the image: kernels are compiled for such once.
        if self.image is not None:
            object.__setattr__(self, "image", read_only(self.image))
        if self.depth_m is not None:
            object.__setattr__(self, "depth_m", read_only(self.depth_m))
        joints = {arm: frozen(position) for arm, position in self.joints.items()}
        object.__setattr__(self, "joints", joints)
