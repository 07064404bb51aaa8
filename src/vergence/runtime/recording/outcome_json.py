"""The outcome of a run as JSON, for its recording, its summary and other readers."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, TypeAdapter

from vergence.signals import Outcome, OutcomeKind, TaskOutcome

_Text = Annotated[str, StringConstraints(max_length=10_000)]
_Time = Annotated[float, Field(ge=0, lt=1e9)]


class _TaskData(BaseModel):
    model_config = ConfigDict(allow_inf_nan=False)

    name: _Text
    begun: _Time
    kind: OutcomeKind
    reason: _Text
    time: _Time


_TASKS: TypeAdapter[list[_TaskData]] = TypeAdapter(Annotated[list[_TaskData], Field(max_length=64)])


def outcome_json(outcome: Outcome) -> dict[str, Any]:
    """Return the outcome as JSON values, with `tasks` if there were several."""
    values: dict[str, Any] = {
        "kind": outcome.kind.value,
        "reason": outcome.reason,
        "time": outcome.time,
    }
    if outcome.tasks:
        values["tasks"] = [
            {"name": task.name, "begun": task.begun, **outcome_json(task.outcome)}
            for task in outcome.tasks
        ]
    return values


def read_outcome(words: Mapping[str, str], tasks: str = "[]") -> Outcome:
    """Read kind, reason and time as text, and tasks as JSON, all of which are untrusted.

    Raises:
        KeyError, ValueError: if they are not valid.
    """
    each = tuple(
        TaskOutcome(task.name, task.begun, Outcome(task.kind, task.reason, task.time))
        for task in _TASKS.validate_json(tasks)
    )
    outcome = Outcome(OutcomeKind(words["kind"]), words["reason"], float(words["time"]), each)
    if not 0 <= outcome.time < 1e9:
        raise ValueError("a time that no run has")
    return outcome
