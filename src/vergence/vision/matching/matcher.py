"""What a matcher is and what it answers."""

from typing import Any, NamedTuple, Protocol

from vergence.arrays import BoolArray, FloatArray, ImageArray


class Matches(NamedTuple):
    """Matched points, the surest first; some may be wrong, which `estimate_two_view` finds out."""

    points_px: FloatArray  # (N, 2) in the current image
    points_star_px: FloatArray  # (N, 2) in the desired image
    reason: str  # empty, or why there are none

    def __bool__(self) -> bool:
        """Whether any match was found."""
        return len(self.points_px) > 0


class Matcher(Protocol):
    """Finds the points of one image again in another: the place for a matcher of a user's own.

    An image is described once and may be matched often, as a goal is.
    """

    def describe(self, image: ImageArray, mask: BoolArray | None = None) -> Any:
        """Return what `match` needs to know of an image.

        Args:
            image: grey, (height, width).
            mask: where the points may be, (height, width); None for everywhere.
        """
        ...

    def match(self, current: Any, desired: Any) -> Matches:
        """Match two images by their descriptions."""
        ...


def finer_of(matcher: Matcher) -> Matcher | None:
    """Return what is asked where a matcher finds too little: its attribute `finer`, if it has one.

    Such as a slower one that finds more.
    """
    finer: Matcher | None = getattr(matcher, "finer", None)
    return finer
