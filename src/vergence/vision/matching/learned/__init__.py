"""Learned features, with weights from a third-party package."""

from vergence.vision.matching.learned.xfeat import XFeat

__all__ = ["XFeat"]
