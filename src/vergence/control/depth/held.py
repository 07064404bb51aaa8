"""Constant depth, as believed at the start."""

from vergence.arrays import FloatArray
from vergence.control.depth.depth import Depths, MeasuredPoints
from vergence.parts import part


@part("depth", "held")
class HeldDepth:
    """The depth believed at the start, whatever moves."""

    @property
    def estimates_motion(self) -> bool:
        """False: it is wrong for a target that moves in depth."""
        return False

    def bind(self, features: FloatArray | None) -> "HeldDepth":
        """Return itself: it has no state."""
        return self

    def update(self, exposure: MeasuredPoints) -> Depths:
        """Return the believed depths."""
        return Depths(exposure.believed_m)
