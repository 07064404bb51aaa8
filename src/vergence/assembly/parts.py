"""What the loop is put together from."""

from typing import NamedTuple

from vergence.assembly.law_context import LawContext
from vergence.control import Law
from vergence.runtime.stages import Perception, Planner


class Parts(NamedTuple):
    """The stages of one run."""

    perception: Perception
    planner: Planner
    law: Law
    context: LawContext  # what the law was made for
    duration_s: float | None = None  # how long the task takes; as long as the cell says if None
