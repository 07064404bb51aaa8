"""The guarantees of the constrained servo and the guard."""

from vergence.studies.guarantees.study import reproduce

__all__ = ["reproduce"]
