"""A known rigid object: its geometry, its corners in windows, its edges from image to image."""

from vergence.vision.known_object.corner_extractor import (
    CornerExtractor,
    CornerMeasurements,
    require_image,
)
from vergence.vision.known_object.edge_measurement import EdgeMeasurement, EdgeMemory
from vergence.vision.known_object.edge_tracker import EdgeTracker
from vergence.vision.known_object.loading import load_object_model, object_model_of
from vergence.vision.known_object.object_model import ObjectModel

__all__ = [
    "CornerExtractor",
    "CornerMeasurements",
    "EdgeMeasurement",
    "EdgeMemory",
    "EdgeTracker",
    "ObjectModel",
    "load_object_model",
    "object_model_of",
    "require_image",
]
