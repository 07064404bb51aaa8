"""Marks attached to objects: round marks, and AprilTag or ArUco markers."""

from vergence.vision.marks.coded import DICTIONARIES, CodedMarks, MarkerDetector
from vergence.vision.marks.mark_tracker import MarkTracker
from vergence.vision.marks.mark_tracking import MarkTracking
from vergence.vision.marks.one_tag import OneTag, one_tag, seen_instead
from vergence.vision.marks.round import RoundMarks, circle_centre_bias, measure_round_marks
from vergence.vision.marks.tag_tracking import TagTracking

__all__ = [
    "DICTIONARIES",
    "CodedMarks",
    "MarkTracker",
    "MarkTracking",
    "MarkerDetector",
    "OneTag",
    "RoundMarks",
    "TagTracking",
    "circle_centre_bias",
    "measure_round_marks",
    "one_tag",
    "seen_instead",
]
