"""The interface of matchers, and their result."""

from typing import Any, NamedTuple, Protocol

from vergence.arrays import BoolArray, FloatArray, ImageArray


class Matches(NamedTuple):
    """Matched points, the best first; some may be wrong, which `estimate_two_view` detects."""

    points_px: FloatArray  # (N, 2) in the current image
    points_star_px: FloatArray  # (N, 2) in the desired image
    reason: str  # empty, or why there are none

    def __bool__(self) -> bool:
        """Whether any match was found."""
        return len(self.points_px) > 0


class Matcher(Protocol):
    """Finds the points of one image in another; implement it for a matcher of your own.

    An image is described once and may be matched often, as a goal image is.
    """

    def describe(self, image: ImageArray, mask: BoolArray | None = None) -> Any:
        """Return the description of an image for `match`.

        Args:
            image: grey, (height, width).
            mask: where the points may be, (height, width); None for everywhere.
        """
        ...

    def match(self, current: Any, desired: Any) -> Matches:
        """Match two images by their descriptions."""
        ...


def finer_of(matcher: Matcher) -> Matcher | None:
    """Return the matcher to use if one finds too few matches: its attribute `finer`, if it has one.

    It is usually slower, and finds more.
    """
    finer: Matcher | None = getattr(matcher, "finer", None)
    return finer
