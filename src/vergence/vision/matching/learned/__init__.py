"""Learned features, by the weights of a package of others."""

from vergence.vision.matching.learned.xfeat import XFeat

__all__ = ["XFeat"]
