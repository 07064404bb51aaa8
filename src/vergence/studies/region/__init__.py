"""Objects without sharp edges, followed by their outline."""

from vergence.studies.region.study import reproduce

__all__ = ["reproduce"]
