"""What a tag on a target means for the rest of a cell file."""

from collections.abc import Iterator, Mapping
from typing import Any

from vergence.cell.named_targets import TARGET, target_key
from vergence.errors import KeyConflict

_LOOKS = ("track", "reach")  # kinds of task with a tracker


def check_tags(values: Mapping[str, Any], source: str) -> None:
    """Refuse features beside a tag, whose corners are the features.

    Raises:
        KeyConflict: that says what to delete.
    """
    targets = _targets(values)
    for name, target in targets.items():
        key = target_key(name)
        tagged = isinstance(target, Mapping) and target.get("tag") is not None
        if tagged and target.get("features"):
            raise KeyConflict(source, f"{key}.features", f"{key}.tag", [f"{key}.features"])
    for place, task in _tasks(values):
        tracker = task.get("tracker") if isinstance(task, Mapping) else None
        if not isinstance(tracker, Mapping) or tracker.get("kind") != "tags":
            continue
        name = _name_of_target(task, targets)
        if _tag(targets.get(name)) is not None and "dictionary" in tracker:
            own = f"{place}.tracker.dictionary"
            raise KeyConflict(source, own, f"{target_key(name)}.tag.dictionary", [own])


def with_tags(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a cell whose tasks find the tag of their target, if it has one.

    It is the tracker of every task that has one and names none.
    """
    targets, found = _targets(values), dict(values)

    def tracked(task: Any) -> Any:
        if not isinstance(task, Mapping) or task.get("kind", "track") not in _LOOKS:
            return task
        tag = _tag(targets.get(_name_of_target(task, targets)))
        if tag is None:
            return task
        tracker = {"kind": "tags", **{key: tag[key] for key in ("dictionary",) if key in tag}}
        own = task.get("tracker")
        if isinstance(own, Mapping) and own.get("kind") == "tags":
            return {**task, "tracker": {**own, **tracker}}
        return {"tracker": tracker, **task}

    if "task" in found:
        found["task"] = tracked(found["task"])
    if isinstance(found.get("tasks"), list | tuple):
        found["tasks"] = [tracked(task) for task in found["tasks"]]
    return found


def _targets(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the targets by name, in whichever form they are written."""
    if TARGET in values:
        return {TARGET: values[TARGET]}
    named = values.get("targets")
    return named if isinstance(named, Mapping) else {}


def _tag(target: Any) -> Mapping[str, Any] | None:
    tag = target.get("tag") if isinstance(target, Mapping) else None
    return tag if isinstance(tag, Mapping) else None


def _name_of_target(task: Mapping[str, Any], targets: Mapping[str, Any]) -> str:
    name = task.get("target")
    return name if isinstance(name, str) else next(iter(targets), TARGET)


def _tasks(values: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the tasks and where they stand."""
    if "task" in values:
        yield "task", values["task"]
    if isinstance(values.get("tasks"), list):
        for number, task in enumerate(values["tasks"]):
            yield f"tasks.{number}", task
