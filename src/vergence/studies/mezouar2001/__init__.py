"""[Mezouar2001]: trajectories in the image inside view and joint limits."""

from vergence.studies.mezouar2001.study import reproduce

__all__ = ["reproduce"]
