"""Planning: what the features or the target's pose should be, and when."""

from vergence.planning.fixed_reference import FixedReference
from vergence.planning.reference import Reference

__all__ = ["FixedReference", "Reference"]
