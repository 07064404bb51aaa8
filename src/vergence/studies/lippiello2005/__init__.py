"""[Lippiello2005]: eye-in-hand and eye-to-hand cameras together."""

from vergence.studies.lippiello2005.study import reproduce

__all__ = ["reproduce"]
