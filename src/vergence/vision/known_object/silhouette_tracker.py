"""Follows the outline of a known object from image to image, by the colours on both sides of it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.camera import Camera
from vergence.camera.lens import pack_lens
from vergence.errors import InputError
from vergence.robot.positive_definite import invert_spd
from vergence.vision.known_object.color_model import (
    ColorModel,
    blank_colors,
    colors_of,
    mixed_colors,
)
from vergence.vision.known_object.contour_fit import (
    DEEP_ODDS,
    contour_points,
    fit_contour,
    line_weights,
    means_of_runs,
    outline_motion,
    segment_scales,
    shared_error,
)
from vergence.vision.known_object.contour_lines import (
    ContourLines,
    count_colors,
    read_lines,
)
from vergence.vision.known_object.contour_maps import Maps, outline_maps
from vergence.vision.known_object.contour_vote import MOST_PLACES, Contour, contour_of
from vergence.vision.known_object.look_alikes import Turn, turns_of
from vergence.vision.known_object.object_model import ObjectModel
from vergence.vision.known_object.silhouette import Outline, outline_of
from vergence.vision.known_object.silhouette_measurement import (
    SilhouetteMeasurement,
    SilhouetteMemory,
    nothing_found,
    share_log_ratio,
)
from vergence.vision.known_object.symmetry import FreeAxes, free_axes, symmetric_turns
from vergence.vision.known_object.turn_test import SURE, TurnTest, View, compare_turns
from vergence.vision.known_object.weak_turns import (
    USUAL,
    hidden_turn_of,
    least_shown_of,
    weak_turns,
    weakest_turn,
)

_MOST_TRIANGLES = 20_000  # of the mesh that is drawn: half a millisecond
_INDEPENDENT = 60  # lines that err apart: neighbours share pixels
_FINE = (1, 1)  # scales one after the other, for a pose that is known to some pixels
_TOLERANCE_PX = 1.5  # residual at which a line counts a quarter, at one pixel a segment
_RUN_PX = 0.6  # mean residual of a run of lines at which it counts a quarter
_STEPS = 3  # of Newton for one outline
_LEARNING_GAPS_PX = (5.0, 2.0, 0.5)  # in the first image the contour is not known well
_GAP_PX = 0.5  # on both sides of the contour, where pixels show both
_LEARNED_DEPTH_PX = 18.0
_FOUND_PX = 2.0  # residual of a line that found the contour
# Of the object's size, by which its origin is wrong while a turn is unknown: across the line of
# sight, and along it if it is like an ellipsoid.
_ASIDE, _FARTHER = 0.04, 0.2
_FORGOTTEN = 0.2  # of the share found, by one image
_AS_USUAL = 0.85  # of it, with which a narrow search is content
_BETTER = 1.2  # times as many lines a wide search has to find
_LEARNED_ODDS = 1.0  # and on one whose colours are learned
_CLEAR = 1.0 / 3.0**2  # information of a line that tells where the contour is, 1/px²


class _Prior(NamedTuple):
    T: FloatArray  # (4, 4) predicted pose
    covariance: FloatArray  # (6, 6) of its error (δp, δθ) along camera axes
    information: FloatArray  # (6, 6) its inverse


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

    shape: ObjectModel = field(init=False, repr=False, compare=False)  # coarse enough to be drawn
    closed: bool = field(init=False, repr=False, compare=False)  # whether the mesh is
    least_shown: float = field(init=False, repr=False, compare=False)  # see `least_shown_of`
    size: float = field(init=False, repr=False, compare=False)  # of the model, m
    axes: FreeAxes = field(init=False, repr=False, compare=False)  # turns that no outline shows
    hidden_turn: FloatArray = field(init=False, repr=False, compare=False)  # see `hidden_turn_of`
    sought: ClassVar[str] = "the outline"

    def __post_init__(self) -> None:
        if self.channels not in (1, 3):
            raise InputError("SilhouetteTracker", "channels", self.channels, "1 or 3")
        shape = self.model.coarsened(_MOST_TRIANGLES)
        object.__setattr__(self, "shape", shape)
        object.__setattr__(self, "closed", shape.closed)
        object.__setattr__(self, "size", self.model.size)
        object.__setattr__(self, "axes", free_axes(shape))
        object.__setattr__(self, "least_shown", least_shown_of(shape, self.axes))
        object.__setattr__(self, "hidden_turn", hidden_turn_of(shape, self.axes))

    @property
    def free(self) -> str:
        """Which turns no image shows; empty if there are none."""
        return str(self.axes)

    def free_motions(self, T_camera_target: FloatArray) -> FloatArray:
        """Return the motions (δp, δθ) that no image shows, (6, K), along camera axes."""
        return self.axes.motions(T_camera_target)

    def blank(self) -> SilhouetteMemory:
        """Return the memory before the first image."""
        return SilhouetteMemory(blank_colors(self.channels), 0.0)

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
        covariance = np.array(pose_covariance)
        prior = _Prior(np.array(T_camera_target), covariance, invert_spd(covariance)[0])
        if memory.colors.known:
            return self._sought(pixels, lens, prior, memory)
        T, colors = prior.T, memory.colors
        for gap_px in _LEARNING_GAPS_PX:
            outline = self._outline(T, lens)
            if outline is not None:
                everywhere = np.ones(len(outline.points), dtype=np.bool_)
                gaps_px = np.full((len(everywhere), 2), gap_px)
                colors = self._counted(pixels, outline, everywhere, ~everywhere, gaps_px)
            seen = self._look(pixels, lens, T, prior, colors, None)
            T = seen.T_camera_target
        return seen

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
        if self.least_shown > USUAL or not (memory.colors.known and seen.weakest.any()):
            return SURE
        lens, T = pack_lens(camera), seen.T_camera_target
        apart_px = np.linalg.norm(np.diff(seen.samples_px, axis=0), axis=1)
        view = View(
            self._pixels(image, camera),
            lens,
            memory.colors.odds,
            self.shape,
            self.closed,
            float(np.median(apart_px)) * self.lines / _INDEPENDENT,
        )
        half_px = 0.5 * self.size * lens[0] / T[2, 3]
        hidden = (self.hidden_turn.reshape(2, 3) @ T[:3, :3].T).ravel()
        motion = max(
            (hidden, seen.weakest), key=lambda each: each[3:] @ pose_covariance[3:, 3:] @ each[3:]
        )
        return compare_turns(view, T, motion, pose_covariance, half_px)

    def elsewhere(self, memory: SilhouetteMemory) -> SilhouetteMemory:
        """Return the memory at another place: an object keeps its colours."""
        return memory

    def contour(self, T_camera_target: FloatArray, camera: Camera) -> Contour:
        """Return places on the outline at a pose (4, 4)."""
        shape, T = self.shape, np.array(T_camera_target)
        outline = outline_of(
            T, pack_lens(camera), shape.vertices, shape.triangles, self.closed, MOST_PLACES
        )
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
        return symmetric_turns(self.shape, self.axes, turns_of(self.shape))

    def log_ratio(
        self,
        seen: SilhouetteMeasurement,
        other: SilhouetteMeasurement,
        camera: Camera,
        chance: float,
    ) -> float:
        """Return by how many nats an image supports one pose more than another."""
        return share_log_ratio(seen, other, _INDEPENDENT / self.lines)

    def remember(self, memory: SilhouetteMemory, seen: SilhouetteMeasurement) -> SilhouetteMemory:
        """Return the memory after an image that was accepted."""
        if not memory.colors.known:
            return SilhouetteMemory(seen.colors, seen.share)
        colors: ColorModel = memory.colors
        if seen.colors.known:
            colors = mixed_colors(colors, seen.colors, self.learned)
        return SilhouetteMemory(colors, memory.share + _FORGOTTEN * (seen.share - memory.share))

    def _sought(
        self, pixels: ImageArray, lens: FloatArray, prior: _Prior, memory: SilhouetteMemory
    ) -> SilhouetteMeasurement:
        """Look close to the prediction; farther away if less is found there than recently.

        Something that comes before the object draws a wide search towards itself.
        """
        seen = self._look(pixels, lens, prior.T, prior, memory.colors, _FINE)
        if seen.share > _AS_USUAL * memory.share:
            return seen
        wide = self._look(pixels, lens, prior.T, prior, memory.colors, None)
        return wide if wide.found > _BETTER * seen.found else seen

    def _pixels(self, image: ImageArray, camera: Camera) -> ImageArray:
        shape = (camera.height, camera.width) + ((3,) if self.channels == 3 else ())
        if image.shape != shape or image.dtype != np.uint8:
            given = f"{image.dtype} of shape {image.shape}"
            raise InputError("SilhouetteTracker", "image", given, f"uint8 of shape {shape}")
        pixels = np.require(image, requirements=("C", "W"))  # one kind of array: one kernel
        return pixels.reshape(camera.height, camera.width, self.channels)

    def _outline(self, T: FloatArray, lens: FloatArray) -> Outline | None:
        return outline_of(
            T, lens, self.shape.vertices, self.shape.triangles, self.closed, self.lines
        )

    def _look(
        self,
        pixels: ImageArray,
        lens: FloatArray,
        T: FloatArray,
        prior: _Prior,
        colors: ColorModel,
        schedule: Sequence[int] | None,
    ) -> SilhouetteMeasurement:
        """Fit the pose from coarse to fine; the last outline is the measurement."""
        outline = self._outline(T, lens)
        scales = list(schedule or ())
        while outline is not None:
            scales = scales or segment_scales(T, lens, outline, prior.covariance)
            scale = scales.pop(0)
            lines = read_lines(pixels, outline, colors.odds, scale)
            T = fit_contour(
                T,
                prior.T,
                prior.information,
                lens,
                outline,
                lines,
                line_weights(lines),
                _TOLERANCE_PX * scale,
                _RUN_PX,
                _STEPS,
            )
            if not scales:
                return self._measured(pixels, lens, T, outline, lines)
            outline = self._outline(T, lens)
        return nothing_found(T, blank_colors(self.channels))

    def _measured(
        self,
        pixels: ImageArray,
        lens: FloatArray,
        T: FloatArray,
        outline: Outline,
        lines: ContourLines,
    ) -> SilhouetteMeasurement:
        moved, slopes = outline_motion(T, lens, outline)
        residuals = lines.offsets_px - moved
        runs = means_of_runs(residuals, outline, lines, line_weights(lines))
        found = (
            lines.usable
            & (np.abs(residuals) < _FOUND_PX)
            & (lines.information > _CLEAR)
            & (lines.deep_odds > DEEP_ODDS)
        )
        slopes = slopes[found]
        learned = found & (lines.deep_odds > _LEARNED_ODDS)
        covered = lines.usable & (lines.deep_odds < -_LEARNED_ODDS)
        # What lies between the contour that was found and the outline that fits may be either's.
        inner, outer = np.sort((lines.offsets_px, moved), axis=0)
        gaps_px = _GAP_PX + np.fmax(np.stack((-inner, outer), axis=1), 0.0)
        unseen, shared = self._unseen(T, lens, slopes), shared_error(slopes, self.bias_px)
        expected, count = int(lines.usable.sum()), int(found.sum())
        # The less of the outline is found, the likelier some of it is something else's.
        doubt = (expected / max(count, 1)) ** 3
        shared = doubt * shared
        enlarged = doubt * max(count / _INDEPENDENT, 1.0)
        return SilhouetteMeasurement(
            *contour_points(outline, lines, found, enlarged, runs),
            T,
            expected,
            count,
            count / max(expected, 1),
            int(np.sum(lines.usable & ~found & (lines.deep_odds > DEEP_ODDS))),
            outline.points_px,
            found,
            self._counted(pixels, outline, learned, covered, gaps_px),
            unseen,
            shared,
            self._astray(T, unseen),
            weakest_turn(slopes, self.axes.motions(T)),
        )

    def _unseen(self, T: FloatArray, lens: FloatArray, slopes: FloatArray) -> FloatArray:
        """Return the motions (6, K) that the outline does not show.

        These are the turns under which, with the best motion of the origin, the outline moves by
        less than the places on it are known. An ellipsoid has one, a mug with hidden handle.
        """
        free = self.axes.motions(T)
        half_px = 0.5 * self.size * lens[0] / T[2, 3]
        weak = weak_turns(slopes, free, half_px, self.least_shown)
        return np.hstack((free, weak))

    def _astray(self, T: FloatArray, unseen: FloatArray) -> FloatArray:
        """Return the covariance of what more is wrong while a turn is unknown, (6, 6).

        Far along a turn that does not show, others go with it: an ellipsoid seen from its end is as
        round as one that is farther away and seen from aside.
        """
        astray = np.zeros((6, 6))
        if unseen.shape[1] > len(self.axes.axes):
            astray[:3, :3] = (_ASIDE * self.size) ** 2 * np.eye(3)
            if self.least_shown > USUAL:
                ray = T[:3, 3] / np.linalg.norm(T[:3, 3])
                astray[:3, :3] += (_FARTHER * self.size) ** 2 * np.outer(ray, ray)
                astray[3:, 3:] = np.pi**2 / 3.0 * np.eye(3)  # of angles that may be anything
        return astray

    def _counted(
        self,
        pixels: ImageArray,
        outline: Outline,
        learned: BoolArray,
        covered: BoolArray,
        gaps_px: FloatArray,
    ) -> ColorModel:
        inside, outside = np.zeros((2, *blank_colors(self.channels).inside.shape))
        count_colors(pixels, outline, learned, covered, gaps_px, _LEARNED_DEPTH_PX, inside, outside)
        colors: ColorModel = colors_of(inside, outside)
        return colors
