"""A work cell as its file describes it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr, ValidationError

from vergence.cell.named_targets import (
    TARGET,
    as_in_file,
    naming_single_target,
    target_key,
    with_named_targets,
)
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
    SwitchTable,
    Table,
    TargetTable,
    Task,
    ToolTable,
    TrackTable,
)
from vergence.cell.settings_text import is_whole, settings_text
from vergence.cell.tagged import check_tags, with_tags
from vergence.cell.tasks import check_sequence, naming_task, with_first_task
from vergence.cell.toml_text import read_toml, setting
from vergence.errors import NOTHING, InputError, KeyConflict, nearest
from vergence.loading import Place, load_part, names_law
from vergence.places import find_cell
from vergence.registry import find
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
            tables["targets"] = _merge(tables.get("targets", {}), own_target)
        values = _merge(own, tables)
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
        values = _with(values, *setting(key, value), key)
        text += f"\n# set: {key} = {value}"
    if seed is not None:
        values["seed"] = seed
        text += f"\n# set: seed = {seed}"
    check_tags(values, str(path))
    return _validate(values, path, text)


def _with(values: Any, keys: list[str], value: Any, place: str) -> Any:
    """Return tables with the value at a place replaced, or removed where it is None.

    Its neighbours are kept, so a table that becomes one of another kind keeps its keys.
    """
    key, *deeper = keys
    if isinstance(values, list) and key.isdigit():
        if int(key) >= len(values):
            allowed = f"0 to {len(values) - 1}" if values else "none: the list is empty"
            raise InputError("--set", place, f"number {key}", allowed)
        changed = list(values)
        changed[int(key)] = _with(values[int(key)], deeper, value, place) if deeper else value
        return changed
    table = dict(values) if isinstance(values, Mapping) else {}
    if isinstance(values, str):  # the name of a part means its table
        table = {"kind": values}
    if deeper:
        table[key] = _with(table.get(key), deeper, value, place)
    elif value is None:
        table.pop(key, None)
    else:
        table[key] = value
    return table


def _merge(values: dict[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return tables with changes put in; see `is_whole` for those that replace one."""
    merged = dict(values)
    for key, change in changes.items():
        old = merged.get(key)
        if isinstance(change, Mapping) and isinstance(old, dict) and not is_whole(change):
            change = _merge(old, change)
        merged[key] = change
    return merged


def _validate(values: dict[str, Any], path: Path, text: str) -> Cell:
    values = with_named_targets(_with_calibrations(values, path), str(path))
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
            _check_target(cell, task)
    for number, stage in enumerate(cell.stages):
        with naming_task(number if cell.tasks else None):
            _check_names(stage)
    return _with_parts(cell)


def _with_parts(cell: Cell) -> Cell:
    """Return the cell with the parts that its tables describe; imports them, so it comes last."""
    place = Place(str(cell.path), "", cell.path.parent)
    servo = find("servo", "servo")

    def law(key: str, table: Any) -> Any:
        if isinstance(table, str):  # a name means a table of that kind
            table = {"kind": table}
        if not isinstance(table, Mapping):
            raise InputError(str(cell.path), key, table, "a table")
        if names_law(table.get("kind"), place):
            return load_part("law", table, place.at(key))
        return servo.from_table(table, place.at(key))

    def filled(table: Table, at: str, **roles: str) -> Table:
        """Return a table with the parts at some of its keys, each of its role."""
        update = {}
        for key, role in roles.items():
            given, usual = getattr(table, key), type(table).model_fields[key].default
            if given is not None:
                update[key] = load_part(role, given, place.at(f"{at}.{key}"), usual or "")
        return table.model_copy(update=update)

    def task_filled(table: Task, at: str) -> Table:
        roles = {"tracker": "tracker", "planner": "planner", "matcher": "matcher"}
        of_task = {key: role for key, role in roles.items() if hasattr(table, key)}
        return filled(table, at, until="task_end", **of_task)

    tasks = tuple(task_filled(table, f"tasks.{i}") for i, table in enumerate(cell.tasks))
    update = {
        "law": law("law", cell.law),
        "laws": {name: law(f"laws.{name}", table) for name, table in cell.laws.items()},
        "targets": {
            name: filled(target, target_key(name), motion="motion")
            for name, target in cell.targets.items()
        },
        "arms": {
            name: filled(arm, f"arms.{name}", motion="arm_motion")
            for name, arm in cell.arms.items()
        },
        "task": tasks[0] if tasks else task_filled(cell.task, "task"),
        "tasks": tasks,
        "perception": filled(cell.perception, "perception", filter="filter"),
    }
    return cell.model_copy(update=update)


def _with_calibrations(values: dict[str, Any], path: Path) -> dict[str, Any]:
    """Put in what the camera files say that a cell names; what cannot be one is left as it is."""
    cameras = values.get("cameras")
    if not isinstance(cameras, Mapping):
        return values
    calibrated = {
        name: _calibrated(table, path, f"cameras.{name}.")
        for name, table in cameras.items()
        if isinstance(table, Mapping) and isinstance(table.get("calibration"), str)
    }
    return {**values, "cameras": {**cameras, **calibrated}}


def _calibrated(table: Mapping[str, Any], path: Path, place: str) -> dict[str, Any]:
    """Return a camera's table with the lens of its camera file."""
    from vergence.camera import read_camera

    own = {key: value for key, value in table.items() if key != "calibration"}
    lens = ("resolution", "focal_mm", "pixel_um", "focal_px", "principal_px", "distortion")
    doubled = [key for key in lens if key in own]
    if doubled:
        raise KeyConflict(str(path), place + doubled[0], place + "calibration", doubled)
    camera = read_camera(path.parent / table["calibration"])
    return own | {
        "resolution": (camera.width, camera.height),
        "focal_px": (camera.fx, camera.fy),
        "principal_px": (camera.cx, camera.cy),
        "distortion": tuple(camera.distortion.tolist()),
    }


def _known_keys(parts: list[str]) -> list[str]:
    """Return the keys of the table that a place lies in, its kind being the last name that fits."""
    tables = [TABLES[part] for part in parts if part in TABLES]
    if not tables:
        return [*Cell.model_fields, TARGET]
    return list(tables[-1].model_fields)


def _check_target(cell: Cell, task: Task) -> None:
    """Refuse a task that is about no target of the cell, or does not say which of several."""
    allowed = f"one of {nearest(task.target or '', cell.targets)}"
    if task.target is None and len(cell.targets) > 1:
        raise InputError(str(cell.path), "task.target", NOTHING, allowed)
    if task.target is not None and task.target not in cell.targets:
        raise InputError(str(cell.path), "task.target", task.target, allowed)


def _check_names(cell: Cell) -> None:
    def check(key: str, name: str, known: Mapping[str, Any]) -> None:
        if name not in known:
            raise InputError(str(cell.path), key, name, nearest(name, known))

    check("task.arm", cell.task.arm, cell.arms)
    check("task.camera", cell.task.camera, cell.cameras)
    for name, camera in cell.cameras.items():
        if camera.arm is not None:
            check(f"cameras.{name}.arm", camera.arm, cell.arms)
        if camera.rate_hz > cell.inner_rate_hz:  # an image a tick at most
            allowed = f"up to inner_rate_hz, {cell.inner_rate_hz:g}"
            raise InputError(str(cell.path), f"cameras.{name}.rate_hz", camera.rate_hz, allowed)
    for name in cell.perception.cameras or ():
        check("perception.cameras", name, cell.cameras)
    for name, target in cell.targets.items():
        if target.carried_by is not None:
            check(f"{target_key(name)}.carried_by", target.carried_by, cell.arms)
    for name, output in cell.outputs.items():
        check(f"outputs.{name}.arm", output.arm, cell.arms)
    if isinstance(cell.task, SwitchTable):
        check("task.output", cell.task.output, cell.outputs)
    _check_sight(cell)
    if cell.tool is not None:
        check("task.tool.camera", cell.tool.camera, cell.cameras)
        _check_tool(cell, cell.tool)


def _check_tool(cell: Cell, tool: ToolTable) -> None:
    """Refuse a tool that is not seen as it should be: by a fixed camera, beside one on the arm."""

    def refuse(key: str, given: str, allowed: str) -> None:
        raise InputError(str(cell.path), key, given, allowed)

    if (carrier := cell.cameras[tool.camera].arm) is not None:
        refuse("task.tool.camera", f"{tool.camera}, which {carrier} carries", "a fixed camera")
    if cell.target.tag is not None:
        given = "a tool beside a target with a tag, but one tracker measures both"
        refuse("task.tool", given, "a tool beside a target with features")
    if cell.cameras[cell.task.camera].arm is None:
        refuse("task.tool", "a second fixed camera", "a task.camera that the arm carries")


def _check_sight(cell: Cell) -> None:
    """Refuse a task whose arm cannot move the target in the task's camera."""
    carrier, arm = cell.cameras[cell.task.camera].arm, cell.task.arm
    held = cell.target.carried_by == arm
    if carrier == arm and held:
        given = f"{cell.task.camera}, which {arm} carries as it does the target"
        raise InputError(str(cell.path), "task.camera", given, "one that does not move with it")
    to_hand = carrier is None and held and cell.task.kind != "reach"
    if carrier != arm and not to_hand:
        raise InputError(
            str(cell.path),
            "task.camera",
            f"{cell.task.camera}, which {arm} does not carry",
            f"a camera with arm = {arm!r}, or a fixed one and target.carried_by = {arm!r}",
        )
