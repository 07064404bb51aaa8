"""The servo as a cell file declares it."""

from collections.abc import Collection, Mapping
from typing import Any, ClassVar, Self

from vergence.control.depth import Depth
from vergence.control.image_motion import MotionSettings
from vergence.control.limits import Limits
from vergence.control.objectives import Objective
from vergence.control.solvers import QuadraticProgram, Solver
from vergence.control.term import Term
from vergence.errors import NOTHING, Absent, InputError, nearest
from vergence.loading import Place, load_part, make_part, part_class
from vergence.parts import field_names, kind_of, knob, part, slot, table_of

_MOST_OBJECTIVES = 32
_OF_TERM = ("weight", "camera")  # keys in an objective's table that are not its own


@part("term", "term")
class WeightedObjective:
    """One objective of a stack."""

    objective: Objective = slot("objective")  # what to do
    weight: float = knob(1.0, above=0, upto=1e6)  # of its quadratic in the sum
    camera: str = knob("", live=False)  # that it is about; the task's if empty


@part("servo", "servo")
class ServoSettings:
    """Objectives, limits and solver, and assumptions about the features between images.

    In a cell file, a table with a `kind` is a servo with that one objective, whose keys are in
    the same table; several are listed in `objectives`.
    """

    listed: ClassVar[bool] = False  # whether a cell file lists its only objective

    # Objectives, each with its weight.
    objectives: tuple[WeightedObjective, ...] = slot("term", many=True)
    limits: Limits | None = slot("limits", None)  # limits; the solver's defaults if absent
    # Solver that computes joint rates from the objectives.
    solver: Solver = slot("solver", QuadraticProgram)
    depth_m: float | None = knob(None, "m", above=0, upto=1e3)  # initial depth
    depth: Depth | None = slot("depth", None)  # source of the depth; chosen automatically if absent
    # Feed the target's motion forward; default: if it moves and the kind of depth allows it.
    feed_forward: bool | None = knob(None)
    prediction: bool = knob(True)  # predict features from their exposure to the present
    # Smoothing time of the target's estimated motion in the image.
    flow_smoothing_s: float = knob(0.2, "s", least=0, upto=10, needs="feed_forward")

    def __post_init__(self) -> None:
        if not self.objectives:
            raise InputError("law", "objectives", Absent("none"), "one objective or more")

    @property
    def kind(self) -> str:
        """The kind of its one objective, or all kinds joined by "+"."""
        return "+".join(kind_of(term.objective) for term in self.objectives)

    @property
    def objective(self) -> Objective:
        """The first objective."""
        return self.objectives[0].objective

    def key_of(self, number: int) -> str:
        """Return where in a cell file an objective is, from its number."""
        return f"law.objectives.{number}" if self.listed or len(self.objectives) > 1 else "law"

    def motion(self, depth: Depth, stationary: bool) -> MotionSettings:
        """Return the assumptions about the features between their exposure and now.

        Args:
            depth: source of their depth.
            stationary: whether the target is declared stationary.
        """
        feeds = self.feed_forward
        if feeds is None:
            feeds = depth.estimates_motion and not stationary
        return MotionSettings(feeds, self.prediction, self.flow_smoothing_s, depth)

    @property
    def terms(self) -> list[Term]:
        """The objectives with weights and cameras."""
        return [Term(term.objective, term.weight, term.camera) for term in self.objectives]

    @classmethod
    def from_table(cls, table: Mapping[str, Any], place: Place) -> Self:
        """Return the settings that a table of a cell file describes.

        Raises:
            InputError: that names file and key, what was given and what is allowed.
        """
        own = {key: value for key, value in table.items() if key in field_names(cls)}
        rest = {key: value for key, value in table.items() if key not in own}
        if "objectives" in own:
            if rest:
                key, value = next(iter(rest.items()))
                allowed = f"beside objectives: {nearest(key, field_names(cls))}"
                if key == "kind":
                    allowed = f"a kind in each objective; {allowed}"
                raise InputError(place.source, f"{place.key}.{key}", value, allowed)
            listed = own["objectives"]
            if not isinstance(listed, list | tuple) or len(listed) > _MOST_OBJECTIVES:
                key = f"{place.key}.objectives"
                raise InputError(
                    place.source, key, listed, f"a list of up to {_MOST_OBJECTIVES} tables"
                )
            own["objectives"] = tuple(
                _term(item, place.at("objectives").at(str(i))) for i, item in enumerate(listed)
            )
        else:
            of_law = {*field_names(cls)} - {"objectives"}
            own["objectives"] = (_term(rest, place, of_law),)
        made: Self = make_part(cls, own, place)
        object.__setattr__(made, "listed", "objectives" in table)
        return made

    def table(self, *, defaults: bool = True) -> dict[str, Any]:
        """Return the table that `from_table` reads, as JSON values."""
        own = table_of(self, defaults=defaults)
        del own["kind"]
        terms = [_flat(term) for term in own.pop("objectives")]
        if len(terms) == 1 and not terms[0].keys() & own.keys():
            if terms[0].get("weight") == 1.0:
                del terms[0]["weight"]
            if not terms[0].get("camera"):
                terms[0].pop("camera", None)
            return terms[0] | own
        return {"objectives": terms, **own}


def _term(given: Any, place: Place, of_law: Collection[str] = ()) -> WeightedObjective:
    """Return an objective from its table, which also contains its weight and camera.

    Args:
        given: the table, or what stands in its place.
        place: of it.
        of_law: keys of the law that may stand in the same table.
    """
    if isinstance(given, WeightedObjective):
        return given
    if not isinstance(given, Mapping):
        term: WeightedObjective = WeightedObjective(objective=load_part("objective", given, place))
        return term
    beside = {key: given[key] for key in _OF_TERM if key in given}
    rest = {key: value for key, value in given.items() if key not in beside}
    if "kind" not in rest:
        key = f"{place.key}.kind"
        raise InputError(place.source, key, NOTHING, "a value")
    objective = part_class("objective", rest.pop("kind"), place, "law" if of_law else "")
    known = {*field_names(objective), *_OF_TERM, *of_law}
    for key in rest:
        if key not in known:
            full = f"{place.key}.{key}"
            given_text = f"a key that {kind_of(objective)} does not have"
            raise InputError(place.source, full, given_text, nearest(key, known))
    made: WeightedObjective = make_part(
        WeightedObjective, {"objective": make_part(objective, rest, place), **beside}, place
    )
    return made


def _flat(term: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table of a term: that of its objective with weight and camera added."""
    return {
        **term["objective"],
        **{key: term[key] for key in _OF_TERM if key in term},
    }
