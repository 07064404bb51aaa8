"""A known rigid object: its geometry, corners in windows, and tracking by edges or outline."""

from vergence.vision.known_object.corner_extractor import (
    CornerExtractor,
    CornerMeasurements,
    require_image,
)
from vergence.vision.known_object.edge_measurement import EdgeMeasurement, EdgeMemory
from vergence.vision.known_object.edge_tracker import EdgeTracker
from vergence.vision.known_object.loading import load_object_model, object_model_of, surface_of
from vergence.vision.known_object.modality import as_followed, has_corners, shown_by_edges
from vergence.vision.known_object.object_model import ObjectModel
from vergence.vision.known_object.silhouette_measurement import SilhouetteMeasurement
from vergence.vision.known_object.silhouette_tracker import SilhouetteTracker
from vergence.vision.known_object.symmetry import FreeAxes, free_axes

__all__ = [
    "has_corners",
    "CornerExtractor",
    "CornerMeasurements",
    "EdgeMeasurement",
    "EdgeMemory",
    "EdgeTracker",
    "FreeAxes",
    "ObjectModel",
    "SilhouetteMeasurement",
    "SilhouetteTracker",
    "as_followed",
    "free_axes",
    "load_object_model",
    "object_model_of",
    "require_image",
    "shown_by_edges",
    "surface_of",
]
