"""[Nelson1995]: avoiding singularities and joint limits while tracking."""

from vergence.studies.nelson1995.study import reproduce

__all__ = ["reproduce"]
