"""Follows the edges of a known object from image to image."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray, IntArray
from vergence.camera import Camera
from vergence.camera.lens import pack_lens
from vergence.errors import InputError
from vergence.vision.known_object.corner_extractor import require_image
from vergence.vision.known_object.edge_lines import edge_points
from vergence.vision.known_object.edge_samples import (
    TEMPLATE,
    EdgeSamples,
    Steps,
    sample_edges,
    search_steps,
    vote_shift,
    without_doubles,
)
from vergence.vision.known_object.object_model import ObjectModel
from vergence.vision.known_object.pose_fit import PoseFit, agreeing, fit_pose, shifted
from vergence.vision.known_object.projection import pixel_rows

_FINE_REACH_PX = 5
_DOUBLE_PX = 5.0  # edges nearer to each other are not told apart
_MOST_SAMPLES = 400  # over all edges
_MOST_PLACES = 40  # of an edge
_LEARNED_PX = 1.0
_UNKNOWN_RATE = 0.5  # at which a place counts that was not looked at yet
_RATE_GAIN = 0.1  # of one image: ten are remembered
_REMEMBERED = 0.85  # share of the old in what an edge is remembered to look like


class EdgeMemory(NamedTuple):
    """What the places along the edges looked like."""

    templates: FloatArray  # (E, P, 9) grey profiles, mean 0, norm 1
    known: BoolArray  # (E, P) whether there is one
    rate: FloatArray  # (E, P) how often each was found of late, 0 … 1


class EdgeMeasurement(NamedTuple):
    """What an image says about the edges, in the form of points that a filter takes."""

    points: FloatArray  # (M, 3) object's frame, m
    points_px: FloatArray  # (M, 2)
    covariance_px: FloatArray  # (M, 2, 2) small across the edge, large along it, px²
    T_camera_target: FloatArray  # (4, 4) the pose that fits this image
    expected: int  # places on edges that should be seen
    found: int  # of them, where an edge was found that looks as remembered
    usual: float  # the same as a share, each place weighing as often as it was found of late
    samples_px: FloatArray  # (N, 2) the places, under the fitted pose
    samples_found: BoolArray  # (N,)
    fit: PoseFit
    samples: EdgeSamples
    steps: Steps

    @property
    def share(self) -> float:
        """How much of what should be seen was found, 0 … 1."""
        return self.found / self.expected if self.expected else 0.0


@dataclass(frozen=True, slots=True)
class EdgeTracker:
    """Measures an object by all of its sharp edges that are seen.

    Steps of the grey value are searched across the predicted edges; a vote over shifts of the whole
    image and a robust fit of the pose decide which of them are the edges. What each place along
    the edges looked like before tells the object from its background. The edges, not the pose, are
    the measurement.
    """

    model: ObjectModel
    contrast: float = 5.0  # least step of an edge, grey values
    candidates: int = 5  # steps kept across each place
    least_reach_px: float = 7.0  # how far to search, at least
    most_reach_px: float = 24.0  # and at most
    likeness: float = 0.4  # least correlation with what is remembered
    bias_px: float = 0.25  # what does not average out along an edge: model, lens

    def __post_init__(self) -> None:
        if not len(self.model.edges):
            allowed = "a model with edges, from a mesh"
            raise InputError(self.model.name, "edges", "none", allowed)

    @property
    def places(self) -> IntArray:
        """How many places each edge has, (E,): as many as its length is worth."""
        length = np.linalg.norm(self.model.edges[:, 1] - self.model.edges[:, 0], axis=1)
        share = length / length.sum()
        places: IntArray = np.clip(np.rint(_MOST_SAMPLES * share), 1, _MOST_PLACES).astype(np.int64)
        return places

    def blank(self) -> EdgeMemory:
        """Return the memory before the first image."""
        shape = (len(self.model.edges), int(self.places.max()))
        return EdgeMemory(
            np.zeros((*shape, 2 * TEMPLATE + 1)),
            np.zeros(shape, dtype=np.bool_),
            np.full(shape, _UNKNOWN_RATE),
        )

    def measure(
        self,
        image: ImageArray,
        camera: Camera,
        T_camera_target: FloatArray,
        pose_covariance: FloatArray,
        memory: EdgeMemory,
    ) -> EdgeMeasurement:
        """Find the edges near where a pose predicts them.

        Args:
            image: grey, of the camera's size, (height, width).
            camera: the camera's model.
            T_camera_target: predicted pose, (4, 4).
            pose_covariance: of its error (δp, δθ) along camera axes, (6, 6); decides how far
                to search.
            memory: what the edges looked like.

        Raises:
            InputError: if the image is not grey 8 bit or not of the camera's size.
        """
        require_image(image, camera)
        lens = pack_lens(camera)
        prior = np.asarray(np.linalg.inv(pose_covariance), dtype=np.float64)
        samples = self._samples(T_camera_target, lens, _DOUBLE_PX)
        reach = self._reach(T_camera_target, lens, samples, pose_covariance)
        steps = self._search(image, samples, reach, memory)
        start = shifted(T_camera_target, lens, *vote_shift(samples, steps, reach))
        fit = fit_pose(start, T_camera_target, prior, lens, samples, steps, 3.0, 1.0, 12)
        blur = _width(fit, steps)
        samples = self._samples(fit.T, lens, max(_DOUBLE_PX, blur))
        steps = self._search(image, samples, _FINE_REACH_PX, memory)
        fit = fit_pose(fit.T, T_camera_target, prior, lens, samples, steps, 1.5, 0.6, 8)
        found = agreeing(fit, steps, self.likeness, 1.5)
        expected, count = int(np.count_nonzero(steps.readable)), int(np.count_nonzero(found))
        points, places, covariances = edge_points(fit, lens, samples, steps, found, self.bias_px)
        return EdgeMeasurement(
            points,
            places,
            # The less of the object is seen, the likelier some of it is something else.
            covariances * (expected / max(count, 1)) ** 4,
            fit.T,
            expected,
            count,
            _usual(memory, samples, steps.readable, found),
            samples.points_px,
            found,
            fit,
            samples,
            steps,
        )

    def remember(self, memory: EdgeMemory, seen: EdgeMeasurement) -> EdgeMemory:
        """Return the memory after an image that was believed.

        Places whose step is right where the fitted pose wants it are learned anew, little by
        little, whatever they look like: backgrounds change, and faces turn.
        """
        templates, known = memory.templates.copy(), memory.known.copy()
        near = (seen.fit.chosen >= 0) & (np.abs(seen.fit.residuals) <= _LEARNED_PX)
        rows = np.flatnonzero(near)
        at = seen.samples.edge[rows], seen.samples.place[rows]
        looks = seen.steps.looks[rows, seen.fit.chosen[rows]]
        share = np.where(known[at], _REMEMBERED, 0.0)[:, None]
        mixed = share * templates[at] + (1.0 - share) * looks
        templates[at] = mixed / np.maximum(np.linalg.norm(mixed, axis=1, keepdims=True), 1e-12)
        known[at] = True
        rate = memory.rate.copy()
        readable = seen.steps.readable
        looked = seen.samples.edge[readable], seen.samples.place[readable]
        rate[looked] += _RATE_GAIN * (seen.samples_found[readable] - rate[looked])
        return EdgeMemory(templates, known, rate)

    def _samples(self, T: FloatArray, lens: FloatArray, apart_px: float) -> EdgeSamples:
        model = self.model
        samples = sample_edges(
            np.ascontiguousarray(T),
            lens,
            model.edges,
            model.edge_normals,
            model.surface,
            self.places,
        )
        alone: EdgeSamples = without_doubles(samples, apart_px)
        return alone

    def _search(
        self, image: ImageArray, samples: EdgeSamples, reach: int, memory: EdgeMemory
    ) -> Steps:
        steps: Steps = search_steps(
            np.ascontiguousarray(image),
            samples,
            reach,
            self.contrast,
            self.candidates,
            memory.templates,
            memory.known,
        )
        return steps

    def _reach(
        self, T: FloatArray, lens: FloatArray, samples: EdgeSamples, covariance: FloatArray
    ) -> int:
        """Three standard deviations of where the edges will be, px, within bounds."""
        rows, widest = np.empty((2, 6)), 0.0
        for X, normal in zip(samples.points[::5], samples.normals[::5], strict=True):
            pixel_rows(T, lens, X, rows)
            across = normal @ rows
            widest = max(widest, float(across @ covariance @ across))
        wanted = 3.0 * np.sqrt(widest) + 3.0
        return int(np.clip(wanted, self.least_reach_px, self.most_reach_px))


def _width(fit: PoseFit, steps: Steps) -> float:
    """How wide the steps are that belong to edges, px: what is nearer is blurred into one."""
    rows = np.flatnonzero(fit.chosen >= 0)
    if not len(rows):
        return 0.0
    return float(np.median(steps.widths[rows, fit.chosen[rows]])) + 2.0


def _usual(
    memory: EdgeMemory, samples: EdgeSamples, readable: BoolArray, found: BoolArray
) -> float:
    """Return the share found of the places, each weighing as often as it was found of late.

    Some edges of an object are never seen, for want of contrast; they say nothing.
    """
    weight = memory.rate[samples.edge[readable], samples.place[readable]]
    total = float(weight.sum())
    return float(weight[found[readable]].sum()) / total if total > 0.0 else 0.0
