"""Follows the outline of a known object from image to image, by the colours on both sides of it."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.camera.lens import pack_lens
from vergence.errors import InputError
from vergence.vision.known_object.color_model import ColorModel, blank_colors, mixed_colors
from vergence.vision.known_object.contour_fit import FINE
from vergence.vision.known_object.contour_maps import Maps, outline_maps
from vergence.vision.known_object.contour_vote import MOST_PLACES, Contour, contour_of
from vergence.vision.known_object.look_alikes import Turn, turns_of
from vergence.vision.known_object.object_model import ObjectModel
from vergence.vision.known_object.outline_fit import (
    INDEPENDENT,
    MISFIT_PX,
    OutlineFit,
    Prior,
    prior_of,
)
from vergence.vision.known_object.outlined_shape import OutlinedShape
from vergence.vision.known_object.silhouette_measurement import (
    SilhouetteMeasurement,
    SilhouetteMemory,
    share_log_ratio,
)
from vergence.vision.known_object.symmetry import FreeAxes, symmetric_turns
from vergence.vision.known_object.turn_test import SURE, TurnTest, View, compare_turns

_FORGOTTEN = 0.2  # of the share found, by one image
_AS_USUAL = 0.85  # of it, with which a narrow search is content
_BETTER = 1.2  # times as many lines a wide search has to find
_WORSE = 1.2  # times the misfit that no other pose reduced, beyond which one is sought again
_FADING = 0.98  # of that misfit, by one image


@dataclass(frozen=True, slots=True)
class SilhouetteTracker:
    """Measures an object by its outline: where its colours give way to others.

    The outline is drawn under the predicted pose; lines across it say where the contour is, from
    histograms of the object's colours and of those beside it [Stoiber2022]; Newton steps fit the
    pose, from coarse to fine. It needs neither edges nor texture.
    """

    model: ObjectModel
    channels: int = 3  # of the images: 3 colours, or 1 where they are grey
    lines: int = 200  # across the outline
    learned: float = 0.2  # share of an image in what the colours are taken to be
    bias_px: float = 0.1  # what does not average out along the outline: shading, model, lens

    shape: OutlinedShape = field(init=False, repr=False, compare=False)
    sought: ClassVar[str] = "the outline"

    def __post_init__(self) -> None:
        if self.channels not in (1, 3):
            raise InputError("SilhouetteTracker", "channels", self.channels, "1 or 3")
        object.__setattr__(self, "shape", OutlinedShape.of(self.model))

    @property
    def axes(self) -> FreeAxes:
        """The axes of the turns that no image shows."""
        return self.shape.axes

    @property
    def free(self) -> str:
        """Which turns no image shows; empty if there are none."""
        return str(self.axes)

    def free_motions(self, T_camera_target: FloatArray) -> FloatArray:
        """Return the motions (δp, δθ) that no image shows, (6, K), along camera axes."""
        return self.axes.motions(T_camera_target)

    def blank(self) -> SilhouetteMemory:
        """Return the memory before the first image."""
        return SilhouetteMemory(blank_colors(self.channels), 0.0, 0.0)

    def measure(
        self,
        image: ImageArray,
        camera: Camera,
        T_camera_target: FloatArray,
        pose_covariance: FloatArray,
        memory: SilhouetteMemory,
    ) -> SilhouetteMeasurement:
        """Find the outline near where a pose predicts it.

        Args:
            image: grey (height, width) or colour (height, width, 3), of the camera's size.
            camera: the camera's model.
            T_camera_target: predicted pose, (4, 4).
            pose_covariance: of its error (δp, δθ) along camera axes, (6, 6); decides how far
                to search.
            memory: what it looked like; without any its colours are learned at the predicted pose.

        Raises:
            InputError: if the image has another size, type or number of channels.
        """
        pixels, lens = self._pixels(image, camera), pack_lens(camera)
        fit = OutlineFit(self.shape, self.lines, self.bias_px, pixels, lens)
        prior = prior_of(T_camera_target, pose_covariance)
        if memory.colors.known:
            return _sought(fit, prior, memory)
        return fit.learning(prior, memory.colors)

    def other_turns(
        self,
        image: ImageArray,
        camera: Camera,
        seen: SilhouetteMeasurement,
        pose_covariance: FloatArray,
        memory: SilhouetteMemory,
    ) -> TurnTest:
        """Compare a measurement with turns that its prediction allows for.

        They are about the axis that this view shows least, or that other views do not show,
        whichever was predicted worse.

        Args:
            image: the image that was measured.
            camera: the camera's model.
            seen: the measurement.
            pose_covariance: of the predicted pose, as for `measure`.
            memory: what the object looked like.
        """
        if self.shape.like_ellipsoid or not (memory.colors.known and seen.weakest.size):
            return SURE
        lens, T = pack_lens(camera), seen.T_camera_target
        apart_px = np.linalg.norm(np.diff(seen.samples_px, axis=0), axis=1)
        view = View(
            self._pixels(image, camera),
            lens,
            memory.colors.odds,
            self.shape.mesh,
            self.shape.closed,
            float(np.median(apart_px)) * self.lines / INDEPENDENT,
        )
        half_px = self.shape.half_px(T, lens)
        hidden = (self.shape.hidden_turn.reshape(2, 3) @ T[:3, :3].T).ravel()
        motion = max(
            (hidden, seen.weakest[:, 0]),
            key=lambda each: each[3:] @ pose_covariance[3:, 3:] @ each[3:],
        )
        return compare_turns(view, T, motion, pose_covariance, half_px)

    def elsewhere(self, memory: SilhouetteMemory) -> SilhouetteMemory:
        """Return the memory at another place: an object keeps its colours."""
        return memory

    def contour(self, T_camera_target: FloatArray, camera: Camera) -> Contour:
        """Return places on the outline at a pose (4, 4)."""
        T = np.array(T_camera_target)
        outline = self.shape.outline(T, pack_lens(camera), MOST_PLACES)
        if outline is None:
            return Contour(np.zeros((0, 2)), np.zeros((0, 2)))
        return contour_of(outline.points_px, outline.normals)

    def maps(self, image: ImageArray, shape: tuple[int, int], memory: SilhouetteMemory) -> Maps:
        """Return how strongly each of (rows, columns) cells of an image shows the outline."""
        import cv2

        coarse = cv2.resize(image, shape[::-1], interpolation=cv2.INTER_AREA)
        pixels = np.asarray(coarse, np.uint8).reshape(*shape, self.channels)
        maps: Maps = outline_maps(pixels, memory.colors.odds)
        return maps

    def symmetries(self) -> list[Turn]:
        """Return the rotations that leave the outline unchanged, other than about a free axis."""
        return symmetric_turns(self.shape.mesh, self.axes, turns_of(self.shape.mesh))

    def log_ratio(
        self,
        seen: SilhouetteMeasurement,
        other: SilhouetteMeasurement,
        camera: Camera,
        chance: float,
    ) -> float:
        """Return by how many nats an image supports one pose more than another."""
        return share_log_ratio(seen, other, INDEPENDENT / self.lines)

    def remember(self, memory: SilhouetteMemory, seen: SilhouetteMeasurement) -> SilhouetteMemory:
        """Return the memory after an image that was accepted."""
        if not memory.colors.known:
            return SilhouetteMemory(seen.colors, seen.share, 0.0)
        colors: ColorModel = memory.colors
        if seen.colors.known:
            colors = mixed_colors(colors, seen.colors, self.learned)
        share = memory.share + _FORGOTTEN * (seen.share - memory.share)
        misfit_px = (
            seen.misfit_px if seen.searched else min(seen.misfit_px, _FADING * memory.misfit_px)
        )
        return SilhouetteMemory(colors, share, misfit_px)

    def _pixels(self, image: ImageArray, camera: Camera) -> ImageArray:
        shape = (camera.height, camera.width) + ((3,) if self.channels == 3 else ())
        if image.shape != shape or image.dtype != np.uint8:
            given = f"{image.dtype} of shape {image.shape}"
            raise InputError("SilhouetteTracker", "image", given, f"uint8 of shape {shape}")
        pixels = np.require(image, requirements=("C", "W"))  # one kind of array: one kernel
        return pixels.reshape(camera.height, camera.width, self.channels)


def _sought(fit: OutlineFit, prior: Prior, memory: SilhouetteMemory) -> SilhouetteMeasurement:
    """Look close to the prediction; elsewhere if it fits worse than recently or less is found.

    Something that comes before the object draws a wide search towards itself.
    """
    seen = fit.near(prior.T, prior, memory.colors, FINE)
    if seen.share > _AS_USUAL * memory.share:
        badly = seen.misfit_px > max(MISFIT_PX, _WORSE * memory.misfit_px)
        return fit.elsewhere(prior, memory.colors, seen) if badly else seen
    wide = fit.near(prior.T, prior, memory.colors)
    return wide if wide.found > _BETTER * seen.found else seen
