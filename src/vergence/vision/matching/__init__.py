"""Matching points between two images, for goals given as a photograph."""

from vergence.vision.matching.compare import Compared, compare_images
from vergence.vision.matching.image_faults import image_fault
from vergence.vision.matching.image_features import ImageFeatures
from vergence.vision.matching.in_turn import InTurn
from vergence.vision.matching.matcher import Matcher, Matches, finer_of
from vergence.vision.matching.sift import Sift, match_features

__all__ = [
    "Compared",
    "ImageFeatures",
    "InTurn",
    "Matcher",
    "Matches",
    "Sift",
    "compare_images",
    "finer_of",
    "image_fault",
    "match_features",
]
