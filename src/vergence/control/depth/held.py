"""Depth that stays as it was believed at the start."""

from vergence.arrays import FloatArray
from vergence.control.depth.depth import Depths, MeasuredPoints
from vergence.parts import part


@part("depth", "held")
class HeldDepth:
    """The depth believed at the start, whatever moves."""

    @property
    def estimates_motion(self) -> bool:
        """It is not right for a target that moves in depth."""
        return False

    def bind(self, features: FloatArray | None) -> "HeldDepth":
        """Return itself: there is nothing to remember."""
        return self

    def update(self, exposure: MeasuredPoints) -> Depths:
        """Return the believed depths."""
        return Depths(exposure.believed_m)
