"""Curves in images: edges along normals, and ellipses, lines and regions fitted to them."""

from vergence.vision.curves.curve_values import CurveValues
from vergence.vision.curves.ellipse_tracker import EllipseTracker
from vergence.vision.curves.ellipse_tracking import EllipseTracking
from vergence.vision.curves.line_tracker import LineTracker
from vergence.vision.curves.line_tracking import LineTracking
from vergence.vision.curves.region_tracker import RegionTracker
from vergence.vision.curves.region_tracking import RegionTracking

__all__ = [
    "CurveValues",
    "EllipseTracker",
    "EllipseTracking",
    "LineTracker",
    "LineTracking",
    "RegionTracker",
    "RegionTracking",
]
