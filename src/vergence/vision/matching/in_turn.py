"""Several matchers, each asked where the ones before find too little."""

from typing import Any

from vergence.arrays import BoolArray, ImageArray
from vergence.errors import NOTHING, InputError
from vergence.parts import part, slot
from vergence.vision.matching.matcher import Matcher, Matches, finer_of


@part("matcher", "in_turn")
class InTurn:
    """Asks one matcher after the other, such as a learned one behind `Sift`."""

    matchers: tuple[Any, ...] = slot("matcher", many=True)  # the first to be asked first

    def __post_init__(self) -> None:
        if not self.matchers:
            raise InputError("", "matchers", NOTHING, "one matcher or more")

    @property
    def finer(self) -> Matcher | None:
        """What is asked next: the first one's finer twin, or the second one."""
        first, *others = self.matchers
        finer = finer_of(first)
        rest = others if finer is None else [finer, *others]
        return InTurn(matchers=tuple(rest)) if rest else None

    def describe(self, image: ImageArray, mask: BoolArray | None = None) -> Any:
        """Return what the first one needs to know of an image."""
        return self.matchers[0].describe(image, mask)

    def match(self, current: Any, desired: Any) -> Matches:
        """Match two images by the first one's descriptions."""
        found: Matches = self.matchers[0].match(current, desired)
        return found
