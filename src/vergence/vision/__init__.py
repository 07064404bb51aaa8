"""Image points from windows of images: an SSD pyramid tracker and the picking of features."""

from vergence.vision.image import grey_image
from vergence.vision.picking import Picked, pick_features
from vergence.vision.ssd_tracker import SsdTracker
from vergence.vision.tracks import PointTracker, Tracks

__all__ = ["Picked", "PointTracker", "SsdTracker", "Tracks", "grey_image", "pick_features"]
