"""One objective of a sum."""

from typing import NamedTuple

from vergence.control.objectives import Objective


class Term(NamedTuple):
    """An objective with its weight and its camera."""

    objective: Objective
    weight: float = 1.0
    camera: str = ""  # its name; the task's if empty
