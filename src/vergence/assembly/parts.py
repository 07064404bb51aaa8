"""What the loop is put together from."""

from typing import NamedTuple

from vergence.assembly.law_context import LawContext
from vergence.assembly.started_driver import StartedDriver
from vergence.control import Law
from vergence.runtime.stages import Perception, Planner


class Parts(NamedTuple):
    """The stages of one run."""

    driver: StartedDriver
    perception: Perception
    planner: Planner
    law: Law
    context: LawContext  # what the law was made of
    duration_s: float | None = None  # how long the task takes; as long as the cell says if None
