"""What `vergence track` follows: an object, a tag or curves, behind one protocol."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vergence.app.tracking.footage import Footage, FootageFrame
from vergence.arrays import ImageArray
from vergence.signals import Outcome


class Result(NamedTuple):
    """How it went."""

    outcome: Outcome
    answer: Mapping[str, Any]  # for JSON, beside the outcome
    lines: tuple[str, ...]  # for people, below the outcome


class Subject(Protocol):
    """Something that is followed through footage, with what is written of it."""

    @property
    def in_color(self) -> bool:
        """Whether images are to be in colour, (height, width, 3); else grey, (height, width)."""
        ...

    @property
    def state(self) -> object:
        """What became of it in the last image; an image where that changes is a key frame."""
        ...

    @property
    def given_up(self) -> bool:
        """Whether later images will not show it either."""
        ...

    @property
    def files(self) -> Mapping[str, Path]:
        """The files that are written."""
        ...

    def writing(self, folder: Path) -> AbstractContextManager[Any]:
        """Return what opens and closes its files in a folder."""
        ...

    def follow(self, image: ImageArray, time: float) -> None:
        """Look at the next image, taken at a time (s)."""
        ...

    def write(self, image_name: str) -> None:
        """Write what the last image showed."""
        ...

    def draw(self, image: ImageArray) -> NDArray[np.uint8]:
        """Return the last image in colour with what was found drawn in, (height, width, 3)."""
        ...

    def result(self, median_ms: float) -> Result:
        """Return how it went.

        Args:
            median_ms: time that `follow` took for an image.
        """
        ...


# Begins to follow what the options ask for, in the first image of the footage.
Start: TypeAlias = Callable[[Footage, FootageFrame], Subject]
