"""A work cell as its file describes it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr, ValidationError

from vergence.cell.camera_files import with_calibrations
from vergence.cell.changed_tables import merged_tables, with_value
from vergence.cell.named_targets import (
    TARGET,
    as_in_file,
    naming_single_target,
    with_named_targets,
)
from vergence.cell.references import check_names, check_target
from vergence.cell.schema import (
    TABLES,
    ArmTable,
    CameraTable,
    CollisionTable,
    DriverTable,
    Duration,
    Name,
    OutputTable,
    Part,
    PerceptionTable,
    SceneTable,
    Table,
    TargetTable,
    Task,
    ToolTable,
    TrackTable,
)
from vergence.cell.settings_text import settings_text
from vergence.cell.tagged import check_tags, with_tags
from vergence.cell.tasks import check_sequence, naming_task, with_first_task
from vergence.cell.toml_text import read_toml, setting
from vergence.cell.with_parts import with_parts
from vergence.errors import Absent, InputError
from vergence.places import find_cell
from vergence.validation import explain


class Cell(Table):
    """Arms, cameras, a target, a task and a law: all that a run depends on."""

    name: Name  # name of the cell; runs are named after it
    duration_s: Duration  # longest duration of a run
    seed: Annotated[int, Field(ge=0, lt=1 << 63)] = 0  # random seed
    # Rate of the physics, the inner loop and the guard.
    inner_rate_hz: Annotated[float, Field(ge=100, le=1e4)] = 500.0
    scene: SceneTable = SceneTable()  # surroundings of the arms
    arms: dict[Name, ArmTable] = Field(min_length=1, max_length=16)  # arms, by name
    cameras: dict[Name, CameraTable] = Field(min_length=1, max_length=32)  # cameras, by name
    collision: CollisionTable = CollisionTable()  # collision avoidance
    # Objects that the cameras observe, by name; [target] is one alone, without a name.
    targets: dict[Name, TargetTable] = Field(min_length=1, max_length=16)
    task: Task  # what the arm should do
    # Sequence of tasks, instead of a single one.
    tasks: Annotated[tuple[Task, ...], Field(max_length=64)] = ()
    perception: PerceptionTable = PerceptionTable()  # how the target's pose is estimated
    # Outputs of the driver, such as a gripper, by name.
    outputs: dict[Name, OutputTable] = Field(default_factory=dict, max_length=16)
    driver: DriverTable | None = None  # settings of the real robot; not needed in simulation
    law: Part  # control law
    # Other laws by name, for tasks and for comparison.
    laws: dict[Name, Part] = Field(default_factory=dict, max_length=64)
    _path: Path = PrivateAttr(default=Path())
    _text: str = PrivateAttr(default="")

    @property
    def path(self) -> Path:
        """The file it was read from; models are searched for beside it."""
        return self._path

    @property
    def text(self) -> str:
        """The file's text, overrides appended as comments."""
        return self._text

    @property
    def outer_rate_hz(self) -> float:
        """The rate of the fastest camera."""
        return max(camera.rate_hz for camera in self.cameras.values())

    @property
    def target(self) -> TargetTable:
        """The target that the task is about."""
        return self.targets[self.target_name]

    @property
    def target_name(self) -> str:
        """Its name."""
        return self.name_of_target(self.task)

    def name_of_target(self, task: Task) -> str:
        """Return the name of the target that a task of the cell is about."""
        return task.target or next(iter(self.targets))

    @property
    def tool(self) -> ToolTable | None:
        """What the task's arm holds before a second camera, if it does."""
        return self.task.tool if isinstance(self.task, TrackTable) else None

    @property
    def placement_error(self) -> tuple[float, float]:
        """How well the target's placement is known, m and degrees."""
        usual = (0.01, 2.0) if self._follows else (0.0, 0.0)
        table = self.perception
        return (
            usual[0] if table.start_error_m is None else table.start_error_m,
            usual[1] if table.start_error_deg is None else table.start_error_deg,
        )

    @property
    def watched(self) -> tuple[str, ...]:
        """The cameras that are looked through: all, unless the file names some to follow by."""
        named = (
            self.perception.cameras if all(t.kind == "follow" for t in self._all_tasks) else None
        )
        return named or tuple(self.cameras)

    def as_tables(self) -> dict[str, Any]:
        """Return what the file of a cell with one task says, for `replace` and for JSON."""
        return as_in_file(self.model_dump(mode="json", exclude={"tasks"}))

    @property
    def stages(self) -> tuple["Cell", ...]:
        """The cell with each of its tasks alone, in order, under the law of that task."""
        if not self.tasks:
            return (self,)
        laws = [self.law if task.law is None else self.laws[task.law] for task in self.tasks]
        return tuple(
            self.model_copy(
                update={"task": task.model_copy(update={"law": None}), "law": law, "tasks": ()}
            )
            for task, law in zip(self.tasks, laws, strict=True)
        )

    @property
    def _all_tasks(self) -> tuple[Task, ...]:
        return self.tasks or (self.task,)

    @property
    def _follows(self) -> bool:
        return any(task.kind == "follow" for task in self._all_tasks)

    def about(self, target: str) -> "Cell":
        """Return a copy whose task is about another target."""
        return self.model_copy(update={"task": self.task.model_copy(update={"target": target})})

    def with_target(self, **values: Any) -> "Cell":
        """Return a copy with some values of the task's target replaced, as they are validated."""
        target = self.target.model_copy(update=values)
        return self.model_copy(update={"targets": {**self.targets, self.target_name: target}})

    def replace(self, **tables: Any) -> "Cell":
        """Return a copy with some values replaced, by nested dictionaries as in the file.

        A table that names its kind, or a law its objectives, replaces the whole table, and `tasks`
        the one task. Of several targets, `target` is the one that the task is about.
        """
        several = bool(self.tasks) or "tasks" in tables
        own = as_in_file(self.model_dump(exclude={"task"} if several else {"tasks"}))
        if TARGET in tables and TARGET not in self.targets:
            own_target = {self.target_name: tables.pop(TARGET)}
            tables["targets"] = merged_tables(tables.get("targets", {}), own_target)
        values = merged_tables(own, tables)
        return _validate(values, self._path, self._text + settings_text(tables, values))


def load_cell(
    name_or_path: str | Path, overrides: Mapping[str, str] | None = None, seed: int | None = None
) -> Cell:
    """Read a cell.

    Args:
        name_or_path: the name of a built-in cell, a cell file, or a folder that holds `cell.toml`.
        overrides: dotted keys and TOML values that replace what the file says, such as
            ``{"target.motion.velocity_m_s": "[0.2, 0, 0]"}``.
        seed: replaces the file's seed.

    Raises:
        InputError: if there is no such cell or anything in it cannot be used.
    """
    path = find_cell(name_or_path)
    text, values = read_toml(path)
    for key, value in (overrides or {}).items():
        if key == "tasks":  # in place of the one task, as `Cell.replace` has it
            values.pop("task", None)
        values = with_value(values, *setting(key, value), key)
        text += f"\n# set: {key} = {value}"
    if seed is not None:
        values["seed"] = seed
        text += f"\n# set: seed = {seed}"
    check_tags(values, str(path))
    try:
        return _validate(values, path, text)
    except InputError as error:
        if not _is_left_over(error, overrides or {}):
            raise
        hint = f"{error.allowed}; --set {error.key}= removes it"
        raise InputError(error.source, error.key, error.given, hint) from None


def _is_left_over(error: InputError, overrides: Mapping[str, str]) -> bool:
    """Return whether a key of the file does not fit a kind that was given for its table."""
    table = error.key.rpartition(".")[0]
    given = error.key not in overrides and not isinstance(error.given, Absent)
    return given and f"{table}.kind" in overrides


def _validate(values: dict[str, Any], path: Path, text: str) -> Cell:
    values = with_named_targets(with_calibrations(values, path), str(path))
    values = with_first_task(with_tags(values), str(path))
    number = 0 if "tasks" in values else None
    with naming_task(number), naming_single_target():
        try:
            cell = Cell.model_validate(values)
        except ValidationError as error:
            raise explain(error, str(path), values, _known_keys) from None
    cell._path, cell._text = path, text
    check_sequence(cell)
    for number, task in enumerate(cell.tasks or (cell.task,)):
        with naming_task(number if cell.tasks else None):
            check_target(cell, task)
    for number, stage in enumerate(cell.stages):
        with naming_task(number if cell.tasks else None):
            check_names(stage)
    return with_parts(cell)


def _known_keys(parts: list[str]) -> list[str]:
    """Return the keys of the table that a place lies in, its kind being the last name that fits."""
    tables = [TABLES[part] for part in parts if part in TABLES]
    if not tables:
        return [*Cell.model_fields, TARGET]
    return list(tables[-1].model_fields)
