"""What an image says about the edges of an object, and what is remembered of them."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.vision.known_object.edge_samples import EdgeSamples, Steps
from vergence.vision.known_object.pose_fit import PoseFit


class EdgeGeometry(NamedTuple):
    """The edges of an object, as kernels take them."""

    edges: FloatArray  # (E, 2, 3) ends of each, object's frame, m
    normals: FloatArray  # (E, 2, 3) of the faces at each
    surface: FloatArray  # (F, 3, 3) triangles that hide, m
    places: IntArray  # (E,) how many places of each are looked at


class EdgeRule(NamedTuple):
    """How to search; the fields of `EdgeTracker`."""

    contrast: float  # least step of an edge, grey values
    candidates: int  # steps kept across each place
    least_reach_px: float
    most_reach_px: float
    likeness: float  # least correlation with what is remembered
    bias_px: float  # what does not average out along an edge


class EdgeMemory(NamedTuple):
    """What the places along the edges looked like."""

    templates: FloatArray  # (E, P, 9) grey profiles, mean 0, norm 1
    known: BoolArray  # (E, P) whether there is one
    rate: FloatArray  # (E, P) how often each was found recently, 0 … 1


class EdgeMeasurement(NamedTuple):
    """What an image says about the edges, in the form of points that a filter takes."""

    points: FloatArray  # (M, 3) object's frame, m
    points_px: FloatArray  # (M, 2)
    covariance_px: FloatArray  # (M, 2, 2) small across the edge, large along it, px²
    T_camera_target: FloatArray  # (4, 4) the pose that fits this image
    expected: int  # places on edges that should be seen
    found: int  # of them, where an edge was found that looks as remembered
    usual: float  # the same as a share, each place weighing as often as it was found recently
    samples_px: FloatArray  # (N, 2) the places, under the fitted pose
    samples_found: BoolArray  # (N,)
    fit: PoseFit
    samples: EdgeSamples
    steps: Steps

    @property
    def unseen(self) -> FloatArray:
        """Motions that do not show, (6, 0): edges in several directions show all."""
        return np.zeros((6, 0))

    @property
    def shared(self) -> FloatArray:
        """Covariance (6, 6) of what all images have wrong alike: in that of the points already."""
        return np.zeros((6, 6))

    @property
    def astray(self) -> FloatArray:
        """Covariance (6, 6) of what more is wrong while a turn is unknown: none is."""
        return np.zeros((6, 6))

    @property
    def share(self) -> float:
        """How much of what should be seen was found, 0 … 1."""
        return self.found / self.expected if self.expected else 0.0
