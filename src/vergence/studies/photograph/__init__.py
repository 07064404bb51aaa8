"""Reaching where a photograph was taken."""

from vergence.studies.photograph.study import reproduce

__all__ = ["reproduce"]
