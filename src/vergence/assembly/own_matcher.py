"""A task's matcher, held to what it promises each time it is asked."""

from typing import Any

import numpy as np

from vergence.arrays import BoolArray, ImageArray
from vergence.errors import InputError
from vergence.loading import asking
from vergence.parts import kind_of
from vergence.vision.matching import Matcher, Matches, finer_of

_KEY = "task.matcher"


class OwnMatcher:
    """Asks a matcher, which may be a user's own, and refuses what is no answer by its name.

    Args:
        part: the matcher.
        source: the file that names it.
    """

    def __init__(self, part: Any, source: str) -> None:
        self._part, self._source = part, source

    @property
    def finer(self) -> Matcher | None:
        """The same of what is asked where this one finds too little."""
        with asking(self._part, self._source, _KEY):
            finer = finer_of(self._part)
        return None if finer is None else OwnMatcher(finer, self._source)

    def describe(self, image: ImageArray, mask: BoolArray | None = None) -> Any:
        """Return what the matcher needs to know of an image."""
        with asking(self._part, self._source, _KEY):
            return self._part.describe(image, mask)

    def match(self, current: Any, desired: Any) -> Matches:
        """Match two images by their descriptions.

        Raises:
            InputError: if the matcher raises, or returns no matches.
        """
        with asking(self._part, self._source, _KEY):
            found = self._part.match(current, desired)
        if not isinstance(found, Matches):
            raise self._refused(type(found).__name__)
        points = [np.asarray(each, dtype=np.float64) for each in found[:2]]
        shapes = [each.shape for each in points]
        if shapes[0] != shapes[1] or len(shapes[0]) != 2 or shapes[0][1] != 2:
            raise self._refused(f"points of the shapes {shapes[0]} and {shapes[1]}")
        if not all(np.isfinite(each).all() for each in points):
            raise self._refused("points that are not finite")
        reason = str(found.reason)
        if not len(points[0]) and not reason:
            reason = f"{kind_of(self._part)} finds no matches"
        return Matches(points[0], points[1], reason)

    def _refused(self, what: str) -> InputError:
        given = f"{kind_of(self._part)}, whose match returned {what}"
        allowed = "Matches of as many points (N, 2) of one image as of the other, in pixels"
        return InputError(self._source, _KEY, given, allowed)
