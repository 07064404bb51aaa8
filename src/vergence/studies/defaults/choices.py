"""What the study of the defaults weighs against each other, and what came of one start."""

from dataclasses import replace
from itertools import product
from typing import NamedTuple, get_args

from vergence.control import InteractionModel
from vergence.studies.defaults.judge import Finish
from vergence.studies.defaults.moving import Kept
from vergence.studies.defaults.run import DEPTHS, Choice

DEFAULT = Choice("mean", "from_features", 0.0, 0.01)
SHARES, MARGINS = (0.0, 0.2), (0.01, 0.03)
# One setting changed at a time: what the others are worth beside the default.
CHOICES = (
    DEFAULT,
    replace(DEFAULT, interaction="current"),
    replace(DEFAULT, interaction="desired"),
    replace(DEFAULT, depth="from_motion"),
    replace(DEFAULT, depth="carried"),
    replace(DEFAULT, depth="held"),
    replace(DEFAULT, manipulability_share=0.2),
    replace(DEFAULT, joint_margin=0.03),
)
# Every combination, the default first.
EVERY = tuple(
    sorted(
        (
            Choice(*numbers)
            for numbers in product(get_args(InteractionModel), DEPTHS, SHARES, MARGINS)
        ),
        key=lambda choice: choice != DEFAULT,
    )
)


class Moving(NamedTuple):
    """How a target that moves is followed."""

    choice: Choice
    feed_forward: bool | None = None  # None: as the depth allows

    @property
    def name(self) -> str:
        """The choice on one line."""
        fed = {None: "", True: ", always fed forward", False: ", not fed forward"}
        return f"{self.choice.interaction} L, {self.choice.depth}{fed[self.feed_forward]}"


MOVING = (
    Moving(DEFAULT),
    Moving(DEFAULT, feed_forward=False),
    *(Moving(choice) for choice in CHOICES[1:6]),
    *(Moving(choice, feed_forward=True) for choice in CHOICES[3:6]),
)


class Tried(NamedTuple):
    """What came of one start."""

    planned: Finish  # by a plan, or the default without one where no plan was found
    plan_s: float  # CPU time of the plan
    served: tuple[Finish, ...]  # without a plan, one for each of `CHOICES`
    infeasible: bool  # proved
    noisy: bool
    every: tuple[Finish, ...] = ()  # one for each of `EVERY`, for some starts
    moving: tuple[Kept, ...] = ()  # one for each of `MOVING`, for some starts
