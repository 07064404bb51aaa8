"""Studies: one file a paper; they only assemble the rooms above."""

from vergence.studies.check import Check, Figure, Progress, StudyResult

__all__ = ["Check", "Figure", "Progress", "StudyResult"]
