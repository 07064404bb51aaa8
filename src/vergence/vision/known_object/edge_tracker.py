"""Tracks the edges of a known object from image to image."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from vergence.arrays import FloatArray, ImageArray, IntArray
from vergence.camera import Camera
from vergence.camera.lens import pack_lens
from vergence.errors import Absent, InputError
from vergence.vision.brightness import brightened
from vergence.vision.known_object.contour_maps import Maps, edge_maps
from vergence.vision.known_object.contour_vote import Contour, contour_of
from vergence.vision.known_object.corner_extractor import require_image
from vergence.vision.known_object.edge_kernel import learn_edges, measure_edges
from vergence.vision.known_object.edge_measurement import (
    EdgeGeometry,
    EdgeMeasurement,
    EdgeMemory,
    EdgeRule,
)
from vergence.vision.known_object.edge_samples import (
    LEAST_COSINE,
    TEMPLATE,
    EdgeSamples,
    sample_edges,
)
from vergence.vision.known_object.look_alikes import Turn, symmetries
from vergence.vision.known_object.object_model import ObjectModel
from vergence.vision.known_object.partial_view import decisive_edges
from vergence.vision.known_object.pose_evidence import edge_nats
from vergence.vision.known_object.turn_test import SURE, TurnTest

_MOST_SAMPLES = 400  # over all edges
_MOST_PLACES = 40  # of an edge
_FEW = 0.7  # fraction of the edges found, below which some of them are probably something else
_WIDER = 4.0  # power by which the variances then grow
_EDGE_ON = 0.0  # cosine of a face that may be seen: edges of such faces may show
_UNKNOWN_RATE = 0.5  # weight of a place that has not been examined yet


@dataclass(frozen=True, slots=True)
class EdgeTracker:
    """Measures an object by all of its visible sharp edges.

    Grey-value steps are searched for across the predicted edges; a vote over shifts of the whole
    image and a robust fit of the pose decide which of them are the edges. The remembered appearance
    of each place along the edges distinguishes the object from its background. The measurement
    consists of the edges, not of the pose.
    """

    model: ObjectModel
    contrast: float = 5.0  # smallest step of an edge, grey values of an image that is not dark
    candidates: int = 5  # steps kept across each place
    least_reach_px: float = 7.0  # smallest search distance
    most_reach_px: float = 24.0  # and largest
    likeness: float = 0.4  # smallest correlation with the remembered appearance
    bias_px: float = 0.25  # error that does not average out along an edge: model, lens

    geometry: EdgeGeometry = field(init=False, repr=False, compare=False)  # of the model
    free: ClassVar[str] = ""  # rotations that no image shows: none, since corners determine all
    sought: ClassVar[str] = "edges"

    def __post_init__(self) -> None:
        if not len(self.model.edges):
            allowed = "a model with edges, from a mesh"
            raise InputError(self.model.name, "edges", Absent("none"), allowed)
        model = self.model
        geometry = EdgeGeometry(model.edges, model.edge_normals, model.surface, _places(model))
        object.__setattr__(self, "geometry", geometry)

    def free_motions(self, _T_camera_target: FloatArray) -> FloatArray:
        """Return the motions that no image shows, (6, 0)."""
        return np.zeros((6, 0))

    def blank(self) -> EdgeMemory:
        """Return the memory before the first image."""
        shape = (len(self.model.edges), int(self.geometry.places.max()))
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
        """Find the edges near their predictions.

        Args:
            image: grey, of the camera's size, (height, width).
            camera: the camera's model.
            T_camera_target: predicted pose, (4, 4).
            pose_covariance: of its error (δp, δθ) along camera axes, (6, 6); determines the search
                distance.
            memory: appearance of the edges.

        Raises:
            InputError: if the image is not grey 8 bit or not of the camera's size.
        """
        require_image(image, camera)
        seen = self._measured(
            image, camera, T_camera_target, pose_covariance, self.geometry, memory
        )
        if seen.found and seen.share < _FEW:
            wider = (_FEW / seen.share) ** _WIDER
            seen = seen._replace(covariance_px=wider * seen.covariance_px)
        return seen

    def without_an_edge(
        self,
        image: ImageArray,
        camera: Camera,
        seen: EdgeMeasurement,
        pose_covariance: FloatArray,
        memory: EdgeMemory,
    ) -> list[FloatArray]:
        """Return the poses (4, 4) that fit if one edge or another is that of something else.

        Each of the edges that decide the pose of a partly hidden object is left out in turn.

        Args:
            image: the image that was measured.
            camera: the camera's model.
            seen: the measurement.
            pose_covariance: size of the search around its pose, (6, 6).
            memory: appearance of the edges.
        """
        poses = []
        for edge in decisive_edges(seen):
            places = self.geometry.places.copy()
            places[edge] = 0
            others = self.geometry._replace(places=places)
            again = self._measured(
                image, camera, seen.T_camera_target, pose_covariance, others, memory
            )
            poses.append(again.T_camera_target)
        return poses

    def _measured(
        self,
        image: ImageArray,
        camera: Camera,
        T_camera_target: FloatArray,
        pose_covariance: FloatArray,
        geometry: EdgeGeometry,
        memory: EdgeMemory,
    ) -> EdgeMeasurement:
        rule = EdgeRule(
            self.contrast,
            self.candidates,
            self.least_reach_px,
            self.most_reach_px,
            self.likeness,
            self.bias_px,
        )
        seen: EdgeMeasurement = measure_edges(
            np.require(brightened(image), requirements=("C", "W")),
            pack_lens(camera),
            np.array(T_camera_target),
            np.array(pose_covariance),
            geometry,
            rule,
            memory,
        )
        return seen

    def elsewhere(self, _memory: EdgeMemory) -> EdgeMemory:
        """Return the memory at another place: none, since edges look like their backgrounds."""
        return self.blank()

    def contour(self, T_camera_target: FloatArray, camera: Camera) -> Contour:
        """Return places on the edges that are visible at a pose (4, 4)."""
        samples = self._samples(T_camera_target, camera, LEAST_COSINE)
        return contour_of(samples.points_px, samples.normals)

    def other_turns(
        self,
        image: ImageArray,
        camera: Camera,
        seen: EdgeMeasurement,
        pose_covariance: FloatArray,
        memory: object,
    ) -> TurnTest:
        """Return that no other turn was possible: rotated poses are tracked in parallel."""
        return SURE

    def log_ratio(
        self, seen: EdgeMeasurement, other: EdgeMeasurement, camera: Camera, chance: float
    ) -> float:
        """Return by how many nats the edges in an image support one pose more than another."""
        return edge_nats(seen, self._shown_at(other, camera), camera, chance) - edge_nats(
            other, self._shown_at(seen, camera), camera, chance
        )

    def _shown_at(self, seen: EdgeMeasurement, camera: Camera) -> EdgeSamples:
        """Return all places on edges that may show at the pose of a measurement."""
        return self._samples(seen.T_camera_target, camera, _EDGE_ON)

    def _samples(
        self, T_camera_target: FloatArray, camera: Camera, least_cosine: float
    ) -> EdgeSamples:
        geometry = self.geometry
        samples: EdgeSamples = sample_edges(
            np.ascontiguousarray(T_camera_target), pack_lens(camera),
            geometry.edges, geometry.normals, geometry.surface, geometry.places, least_cosine,
        )  # fmt: skip
        return samples

    def maps(self, image: ImageArray, shape: tuple[int, int], _memory: EdgeMemory) -> Maps:
        """Return how strongly each of (rows, columns) cells of a grey image shows an edge."""
        import cv2

        coarse = cv2.resize(brightened(image), shape[::-1], interpolation=cv2.INTER_AREA)
        maps: Maps = edge_maps(np.asarray(coarse, np.uint8))
        return maps

    def symmetries(self) -> list[Turn]:
        """Return the rotations that leave the edges unchanged."""
        return symmetries(self.model)

    def remember(self, memory: EdgeMemory, seen: EdgeMeasurement) -> EdgeMemory:
        """Return the memory after an accepted image.

        Places whose step agrees with the fitted pose are learned gradually, whatever they look
        like, because backgrounds change and faces turn.
        """
        learned: EdgeMemory = learn_edges(memory, seen)
        return learned


def _places(model: ObjectModel) -> IntArray:
    """Return the number of places on each edge, (E,), according to its length."""
    length = np.linalg.norm(model.edges[:, 1] - model.edges[:, 0], axis=1)
    share = length / length.sum()
    places: IntArray = np.clip(np.rint(_MOST_SAMPLES * share), 1, _MOST_PLACES).astype(np.int64)
    return places
