"""Laws and trackers with cameras as bad as real ones."""

from vergence.studies.imaging.study import reproduce

__all__ = ["reproduce"]
