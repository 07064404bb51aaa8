"""Studies: a package for each; they only assemble the rooms above."""

from vergence.studies.check import Check, Figure, Others, Progress, Spread, StudyResult
from vergence.studies.reproduce import PAPERS, reproduce

__all__ = ["PAPERS", "Check", "Figure", "Others", "Progress", "Spread", "StudyResult", "reproduce"]
