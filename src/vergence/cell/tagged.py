"""What a tag on the target means for the rest of a cell file."""

from collections.abc import Mapping
from typing import Any

from vergence.errors import KeyConflict


def check_tag(values: Mapping[str, Any], source: str) -> None:
    """Refuse features beside a tag, whose corners are the features.

    Raises:
        KeyConflict: that says what to delete.
    """
    target = values.get("target")
    if isinstance(target, Mapping) and target.get("tag") is not None and target.get("features"):
        raise KeyConflict(source, "target.features", "target.tag", ["target.features"])
    if not isinstance(target, Mapping) or not isinstance(target.get("tag"), Mapping):
        return
    for key in (*(("task",) if "task" in values else ()), *_places(values.get("tasks"))):
        number = key.partition(".")[2]
        task = values["tasks"][int(number)] if number else values["task"]
        tracker = task.get("tracker") if isinstance(task, Mapping) else None
        if not isinstance(tracker, Mapping) or tracker.get("kind") != "tags":
            continue
        if "dictionary" in tracker:
            place = f"{key}.tracker.dictionary"
            raise KeyConflict(source, place, "target.tag.dictionary", [place])


def _places(tasks: Any) -> list[str]:
    return [f"tasks.{k}" for k in range(len(tasks))] if isinstance(tasks, list) else []


def with_tag(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a cell whose tasks find the tag of the target, if it has one.

    It is the tracker of every task that has one and names none.
    """
    target = values.get("target")
    tag = target.get("tag") if isinstance(target, Mapping) else None
    if not isinstance(tag, Mapping):
        return dict(values)
    tracker = {"kind": "tags", **{key: tag[key] for key in ("dictionary",) if key in tag}}

    def tracked(task: Any) -> Any:
        kinds = ("track", "reach")
        if not isinstance(task, Mapping) or task.get("kind", "track") not in kinds:
            return task
        own = task.get("tracker")
        if isinstance(own, Mapping) and own.get("kind") == "tags":
            return {**task, "tracker": {**own, **tracker}}
        return {"tracker": tracker, **task}

    found = dict(values)
    if "task" in found:
        found["task"] = tracked(found["task"])
    if isinstance(found.get("tasks"), list | tuple):
        found["tasks"] = [tracked(task) for task in found["tasks"]]
    return found
