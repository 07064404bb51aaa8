"""Marks that users put on things: round ones, and AprilTag or ArUco markers."""

from vergence.vision.marks.coded import DICTIONARIES, CodedMarks, MarkerDetector, marker_corners
from vergence.vision.marks.mark_tracker import MarkTracker
from vergence.vision.marks.mark_tracking import MarkTracking
from vergence.vision.marks.round import RoundMarks, circle_centre_bias, measure_round_marks

__all__ = [
    "DICTIONARIES",
    "CodedMarks",
    "MarkTracker",
    "MarkTracking",
    "MarkerDetector",
    "RoundMarks",
    "circle_centre_bias",
    "marker_corners",
    "measure_round_marks",
]
