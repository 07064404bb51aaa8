"""Points of one image found again in another, and what a photograph shows of where to go."""

from vergence.vision.matching.compare import Compared, compare_images
from vergence.vision.matching.image_faults import image_fault
from vergence.vision.matching.matcher import Matcher, Matches
from vergence.vision.matching.sift import ImageFeatures, Sift, match_features

__all__ = [
    "Compared",
    "ImageFeatures",
    "Matcher",
    "Matches",
    "Sift",
    "compare_images",
    "image_fault",
    "match_features",
]
