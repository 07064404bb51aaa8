"""Several matchers, each tried if the previous ones find too few matches."""

from typing import Any

from vergence.arrays import BoolArray, ImageArray
from vergence.errors import NOTHING, InputError
from vergence.parts import part, slot
from vergence.vision.matching.matcher import Matcher, Matches, finer_of


@part("matcher", "in_turn")
class InTurn:
    """Tries several matchers in turn, such as a learned one after `Sift`."""

    matchers: tuple[Any, ...] = slot("matcher", many=True)  # the first to be asked first

    def __post_init__(self) -> None:
        if not self.matchers:
            raise InputError("", "matchers", NOTHING, "one matcher or more")

    @property
    def finer(self) -> Matcher | None:
        """The next one to try: the finer variant of the first one, or the second one."""
        first, *others = self.matchers
        finer = finer_of(first)
        rest = others if finer is None else [finer, *others]
        return InTurn(matchers=tuple(rest)) if rest else None

    def describe(self, image: ImageArray, mask: BoolArray | None = None) -> Any:
        """Return the first matcher's description of an image."""
        return self.matchers[0].describe(image, mask)

    def match(self, current: Any, desired: Any) -> Matches:
        """Match two images by the first matcher's descriptions."""
        found: Matches = self.matchers[0].match(current, desired)
        return found
