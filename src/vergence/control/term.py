"""The objectives of a sum."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

from vergence.control.objectives import Objective
from vergence.errors import Absent, InputError, nearest


class Term(NamedTuple):
    """An objective with its weight and its camera."""

    objective: Objective
    weight: float = 1.0
    camera: str = ""  # its name; the task's if empty


def terms_of(
    objectives: Objective | Sequence[Objective | Term], cameras: Collection[str]
) -> list[Term]:
    """Return objectives as terms, each with the name of its camera.

    Args:
        objectives: one, or those of a sum.
        cameras: the names of all, the main one first.

    Raises:
        InputError: if there is no objective, or one is about a camera that there is not.
    """
    listed = objectives if isinstance(objectives, Sequence) else [objectives]
    if not listed:
        raise InputError("Servo", "objectives", Absent("none"), "one objective or more")
    first = next(iter(cameras))
    terms = []
    for given in listed:
        term = given if isinstance(given, Term) else Term(given)
        name = term.camera or first
        if name not in cameras:
            raise InputError("Servo", "objectives", name, nearest(name, cameras))
        terms.append(Term(term.objective, term.weight, name))
    return terms
