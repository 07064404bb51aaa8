"""What measures a known object in an image, by its edges or by its outline."""

from typing import Any, Protocol

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.vision.known_object import ObjectModel
from vergence.vision.known_object.contour_maps import Maps
from vergence.vision.known_object.contour_vote import Contour
from vergence.vision.known_object.look_alikes import Turn
from vergence.vision.known_object.turn_test import TurnTest


class Measurement(Protocol):
    """The measurement of an object in an image, as points for a filter."""

    points: FloatArray  # (M, 3) object's frame, m
    points_px: FloatArray  # (M, 2)
    covariance_px: FloatArray  # (M, 2, 2) px²
    T_camera_target: FloatArray  # (4, 4) the pose that fits this image
    expected: int  # number of places that should be visible
    usual: float  # fraction found, each place weighted by how often it was found recently
    samples_px: FloatArray  # (N, 2) the places examined
    samples_found: np.typing.NDArray[np.bool_]  # (N,)

    @property
    def unseen(self) -> FloatArray:
        """Motions (δp, δθ) that are not observable, (6, K), along camera axes, m and rad."""
        ...

    @property
    def shared(self) -> FloatArray:
        """Covariance (6, 6) of the pose error common to all images."""
        ...

    @property
    def astray(self) -> FloatArray:
        """Covariance (6, 6) of the additional error while a rotation is unknown."""
        ...

    @property
    def share(self) -> float:
        """Fraction of what should be visible that was found, 0 … 1."""
        ...

    @property
    def uncovered(self) -> float:
        """Fraction found of what nothing covers, as far as the image tells, 0 … 1."""
        ...


class ObjectTracker(Protocol):
    """Measures an object near its predicted pose: `EdgeTracker`, `SilhouetteTracker`."""

    @property
    def model(self) -> ObjectModel:
        """The object."""
        ...

    @property
    def free(self) -> str:
        """Which rotations no image can show; empty if there are none."""
        ...

    def free_motions(self, T_camera_target: FloatArray) -> FloatArray:
        """Return the motions (δp, δθ) that no image can show, (6, K), along camera axes."""
        ...

    @property
    def sought(self) -> str:
        """What it searches for, for messages."""
        ...

    def symmetries(self) -> list[Turn]:
        """Return the rotations after which no image of it differs, except about free axes."""
        ...

    def blank(self) -> Any:
        """Return the memory before the first image."""
        ...

    def elsewhere(self, memory: Any) -> Any:
        """Return what of the memory holds at another place, before another background."""
        ...

    def contour(self, T_camera_target: FloatArray, camera: Camera) -> Contour:
        """Return the places that a search of whole images uses, at a pose (4, 4)."""
        ...

    def maps(self, image: ImageArray, shape: tuple[int, int], memory: Any) -> Maps:
        """Return how strongly (rows, columns) cells of an image show such places."""
        ...

    def measure(
        self,
        image: ImageArray,
        camera: Camera,
        T_camera_target: FloatArray,
        pose_covariance: FloatArray,
        memory: Any,
    ) -> Any:
        """Return the `Measurement` of an image."""
        ...

    def other_turns(
        self,
        image: ImageArray,
        camera: Camera,
        seen: Any,
        pose_covariance: FloatArray,
        memory: Any,
    ) -> TurnTest:
        """Compare a measurement of an image with turns that its prediction allows for.

        Args:
            image: the image that was measured.
            camera: the camera's model.
            seen: the measurement.
            pose_covariance: of the predicted pose, (6, 6), as for `measure`.
            memory: appearance of the object.
        """
        ...

    def log_ratio(self, seen: Any, other: Any, camera: Camera, chance: float) -> float:
        """Return the log likelihood ratio of one pose to another from the same image, nats.

        Args:
            seen: the measurement at the first pose.
            other: the measurement at the second.
            camera: the camera's model.
            chance: fraction that is found at wrong poses.
        """
        ...

    def remember(self, memory: Any, seen: Any) -> Any:
        """Return the memory after an accepted image."""
        ...
