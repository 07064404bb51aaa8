"""Marks that users put on things: round ones, and AprilTag or ArUco markers."""

from vergence.vision.marks.coded import DICTIONARIES, CodedMarks, MarkerDetector
from vergence.vision.marks.mark_tracker import MarkTracker
from vergence.vision.marks.mark_tracking import MarkTracking
from vergence.vision.marks.round import RoundMarks, circle_centre_bias, measure_round_marks
from vergence.vision.marks.tag_tracking import TagTracking

__all__ = [
    "DICTIONARIES",
    "CodedMarks",
    "MarkTracker",
    "MarkTracking",
    "MarkerDetector",
    "RoundMarks",
    "TagTracking",
    "circle_centre_bias",
    "measure_round_marks",
]
