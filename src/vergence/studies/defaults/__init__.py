"""The default settings against their alternatives."""

from vergence.studies.defaults.study import reproduce

__all__ = ["reproduce"]
