"""Servoing with every kind of feature, beside ViSP."""

from vergence.studies.features.study import reproduce

__all__ = ["reproduce"]
