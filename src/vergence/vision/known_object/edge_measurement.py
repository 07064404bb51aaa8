"""The measurement of an object's edges in an image, and their remembered appearance."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.vision.known_object.edge_samples import EdgeSamples, Steps
from vergence.vision.known_object.pose_fit import PoseFit


class EdgeGeometry(NamedTuple):
    """The edges of an object, in the form that kernels take."""

    edges: FloatArray  # (E, 2, 3) ends of each, object's frame, m
    normals: FloatArray  # (E, 2, 3) of the faces at each
    surface: FloatArray  # (F, 3, 3) occluding triangles, m
    places: IntArray  # (E,) number of places on each that are examined


class EdgeRule(NamedTuple):
    """Settings of the search; the fields of `EdgeTracker`."""

    contrast: float  # smallest step of an edge, grey values
    candidates: int  # steps kept across each place
    least_reach_px: float
    most_reach_px: float
    likeness: float  # smallest correlation with the remembered appearance
    bias_px: float  # error that does not average out along an edge


class EdgeMemory(NamedTuple):
    """The appearance of the places along the edges."""

    templates: FloatArray  # (E, P, 9) grey profiles, mean 0, norm 1
    known: BoolArray  # (E, P) whether there is one
    rate: FloatArray  # (E, P) how often each was found recently, 0 … 1


class EdgeMeasurement(NamedTuple):
    """The measurement of the edges in an image, as points for a filter."""

    points: FloatArray  # (M, 3) object's frame, m
    points_px: FloatArray  # (M, 2)
    covariance_px: FloatArray  # (M, 2, 2) small across the edge, large along it, px²
    T_camera_target: FloatArray  # (4, 4) the pose that fits this image
    expected: int  # number of places on edges that should be visible
    found: int  # number of them at which an edge was found that looks as remembered
    usual: float  # the same as a fraction, each place weighted by how often it was found recently
    samples_px: FloatArray  # (N, 2) the places, under the fitted pose
    samples_found: BoolArray  # (N,)
    fit: PoseFit
    samples: EdgeSamples
    steps: Steps
    blur: float  # deviation of the edges' places relative to that in a sharp image, at least 1

    @property
    def unseen(self) -> FloatArray:
        """Unobservable motions, (6, 0): edges in several directions determine all motions."""
        return np.zeros((6, 0))

    @property
    def shared(self) -> FloatArray:
        """Covariance (6, 6) of the error common to all images: included in that of the points."""
        return np.zeros((6, 6))

    @property
    def astray(self) -> FloatArray:
        """Covariance (6, 6) of the additional error while a rotation is unknown: zero."""
        return np.zeros((6, 6))

    @property
    def share(self) -> float:
        """Fraction of what should be visible that was found, 0 … 1."""
        return self.found / self.expected if self.expected else 0.0

    @property
    def uncovered(self) -> float:
        """Fraction found of what nothing covers: of all, since edges do not tell."""
        return self.share
