"""The tasks of a cell, one after another on one loop."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace

from vergence.arrays import FloatArray
from vergence.assembly.assemble import assemble_parts, task_parts
from vergence.assembly.parts import Parts
from vergence.assembly.tasks.check_task import check_task
from vergence.assembly.tasks.rest import Rest
from vergence.assembly.tasks.task_stages import stages_of, timeouts_of
from vergence.assembly.warm_up import warm_up
from vergence.cell import Cell
from vergence.cell.schema import FollowTable, TrackTable
from vergence.cell.tasks import naming_task
from vergence.errors import InputError
from vergence.estimation import FollowedPose
from vergence.runtime import Driver, Listener
from vergence.runtime.listeners import Listeners
from vergence.runtime.stages import Stages
from vergence.signals import Frame, Outcome, OutcomeKind, TaskOutcome
from vergence.simulation import SimulatedDriver
from vergence.simulation.cell_model import CellModel


class TaskSequence:
    """Hands the loop one task of a cell after another, and keeps how each of them ended.

    From one task to the next the arm comes to rest, see `Rest`; what cannot be done any more from
    where it is then ends the run. A cell with a single task is a sequence of one.

    Args:
        cell: whose tasks are run.
        images: look through images; if not, at the exact projections of a simulated driver.
        listeners: hear when a task begins and ends.
        attend: is given the parts of each task but the first before it begins.
    """

    def __init__(
        self,
        cell: Cell,
        images: bool,
        listeners: Sequence[Listener],
        attend: Callable[[Parts], None],
    ) -> None:
        self._cell, self._cells, self._images = cell, cell.stages, images
        self._listeners, self._attend = Listeners(listeners), attend
        self._number = 0  # of the task that runs, or is prepared
        self._begun = 0.0  # s, when it was
        self._first: Parts | None = None
        self._followed: Mapping[str, FollowedPose] = {}  # by target, in the task that ran last
        self._rest: Rest | None = None  # while the next task is prepared
        self._ended: list[TaskOutcome] = []
        self._failed: Outcome | None = None  # why the next task could not be prepared

    def first(self, driver: Driver, frames: Mapping[str, Frame] | None) -> Parts | Outcome:
        """Return the parts of the first task, or why it cannot be done.

        Args:
            driver: of the cell.
            frames: images to begin with; see `assemble_parts`.

        Raises:
            InputError: if the cell cannot be run as it is written.
        """
        parts = self._assembled(driver, frames)
        if not isinstance(parts, Parts):
            return parts
        for number, cell in enumerate(self._cells):  # before anything moves
            with self._naming(number):
                check_task(cell, parts.context, driver, self._images)
        warm_up(parts, self._cell.task.arm, 1.0 / self._cell.outer_rate_hz)
        follows = isinstance(self._cells[0].task, TrackTable | FollowTable)
        if follows and not frames and not parts.driver.sim_time:
            # A target that moves is no longer where the first images show it; by now this is quick.
            parts = self._assembled(driver, model=parts.context.model)
        self._first = parts if isinstance(parts, Parts) else None
        if isinstance(parts, Parts):
            self._followed = parts.context.followed
        return parts

    def _assembled(
        self,
        driver: Driver,
        frames: Mapping[str, Frame] | None = None,
        model: CellModel | None = None,
    ) -> Parts | Outcome:
        with self._naming(0):
            return assemble_parts(self._cells[0], driver, self._images, model, frames)

    def begin(self) -> None:
        """Say that the first task begins."""
        self._tell_begun(0.0)

    def next_stages(self, outcome: Outcome) -> Stages | None:
        """Return what comes after a task, or after the rest before it; None at the end."""
        if self._rest is not None:
            return self._prepared(self._rest, outcome)
        self._end_task(outcome)
        if not outcome.succeeded or self._number + 1 == len(self._cells):
            return None
        self._number += 1
        self._begun = outcome.time
        return self._resting()

    def outcome(self, outcome: Outcome) -> Outcome:
        """Return how the run ends, with how each task did."""
        if self._failed is not None and outcome.succeeded:
            outcome = self._failed
        if len(self._cells) == 1:
            return outcome
        if len(self._ended) == self._number:  # nobody asked what comes next
            self._end_task(outcome)
        last, count = self._ended[-1], len(self._cells)
        reason = f"all {count} tasks are done; the last, {last.name}: {outcome.reason}"
        if not outcome.succeeded:
            reason = f"task {self._number + 1} of {count}, {last.name}: {outcome.reason}"
        return replace(outcome, reason=reason, tasks=tuple(self._ended))

    def _naming(self, number: int) -> AbstractContextManager[None]:
        """Let complaints about a task alone name its place in the file."""
        several = self._cell.tasks
        return naming_task(number, several[number].law) if several else naming_task(None)

    def _resting(self) -> Stages:
        """Return what the arm comes to rest by, while the next task is prepared."""
        assert self._first is not None
        driver, task = self._first.driver, self._cells[self._number].task
        self._rest = Rest(self._cells[self._number].watched, self._prepare, driver.worker())
        return Stages(self._rest, self._rest, self._rest, timeouts_of(task))

    def _prepare(self, frames: Mapping[str, Frame]) -> Parts | Outcome:
        """Return the parts of the next task, from images that were taken at rest."""
        assert self._first is not None
        cell, started, time = self._cells[self._number], self._first.driver, self._begun
        started.frames = dict(frames)
        if isinstance(started.driver, SimulatedDriver):
            started.frames = started.driver.take_up(cell.task, frames)
        try:
            with self._naming(self._number):
                model, believed = self._first.context.model, self._believed(frames)
                parts = task_parts(cell, started, self._images, model, believed)
        except InputError as error:
            reason = str(error).removeprefix(f"{error.source}: ")
            return Outcome(OutcomeKind.INFEASIBLE, reason, time)
        if isinstance(parts, Parts):
            self._followed = parts.context.followed
            warm_up(parts, cell.task.arm, 1.0 / cell.outer_rate_hz)
        return parts

    def _believed(self, frames: Mapping[str, Frame]) -> dict[str, FloatArray]:
        """Return where the last task left the targets that it followed, (4, 4) by name."""
        newest = max(frames.values(), key=lambda frame: frame.time)
        return {
            name: followed.pose_at(newest)
            for name, followed in self._followed.items()
            if not followed.lost
        }

    def _prepared(self, rest: Rest, outcome: Outcome) -> Stages | None:
        self._rest = None
        parts = rest.prepared
        if not isinstance(parts, Parts):
            failed = outcome if parts is None else replace(parts, time=outcome.time)
            self._failed = failed
            return None
        self._begun = outcome.time
        self._tell_begun(outcome.time)
        self._attend(parts)
        return stages_of(self._cells[self._number], parts, later=True)

    def _tell_begun(self, time: float) -> None:
        if self._cell.tasks:
            name = self._cells[self._number].task.called
            text = f"{self._number + 1} of {len(self._cells)}: {name}"
            self._listeners.event(time, "task begun", text)

    def _end_task(self, outcome: Outcome) -> None:
        name = self._cells[self._number].task.called
        self._ended.append(TaskOutcome(name, self._begun, outcome))
        if self._cell.tasks:
            text = f"{name}: {outcome.kind.value}, {outcome.reason}"
            self._listeners.event(outcome.time, "task over", text)
