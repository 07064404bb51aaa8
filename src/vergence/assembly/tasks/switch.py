"""The task `switch`: a named output of the driver is set, while the arm rests."""

from collections.abc import Callable

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.law_context import LawContext
from vergence.assembly.parts import Parts
from vergence.assembly.started_driver import StartedDriver
from vergence.assembly.tasks.advance import NotLooking
from vergence.cell import Cell
from vergence.cell.schema import SwitchTable
from vergence.errors import InputError, nearest
from vergence.runtime.driver import Driver, outputs_of
from vergence.signals import (
    JointCommand,
    JointState,
    Observation,
    Outcome,
    OutcomeKind,
    Reference,
)


def switch_parts(context: LawContext, task: SwitchTable, driver: StartedDriver) -> Parts:
    """Put together what sets an output once and waits."""
    name, value = task.output, task.value
    wait = OutputWait(task, lambda: driver.set_output(name, value))
    joint_count = context.arm.joint_count
    return Parts(driver, NotLooking(), wait, AtRest(joint_count), context)


def require_output(cell: Cell, driver: Driver) -> None:
    """Refuse a task that sets an output which the driver does not have.

    Raises:
        InputError: that names the outputs there are.
    """
    if not isinstance(cell.task, SwitchTable):
        return
    name, known = cell.task.output, outputs_of(driver)
    if name not in known:
        allowed = f"an output of the driver: {nearest(name, known)}"
        raise InputError(str(cell.path), "task.output", name, allowed)


class AtRest:
    """Law of an arm that stays where it is.

    Args:
        joint_count: of the arm.
    """

    def __init__(self, joint_count: int) -> None:
        self._rest: FloatArray = np.zeros(joint_count)

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return rates of zero."""
        return JointCommand(self._rest, np.zeros(6))


class OutputWait:
    """Planner that sets an output once, and ends its task some time later.

    Args:
        task: that is done.
        set_output: sets it.
    """

    def __init__(self, task: SwitchTable, set_output: Callable[[], None]) -> None:
        self._task, self._set_output = task, set_output
        self._set_at: float | None = None  # s
        self._told = False

    def reference(self, time: float) -> Reference:
        """Return that no features are desired."""
        return Reference(time)

    def conclusion(self, time: float) -> Outcome | None:
        """Set the output when it is asked first; return that it was, once it has had its time."""
        if self._set_at is None:
            self._set_output()
            self._set_at = time
        if not self._told or time - self._set_at < self._task.wait_s:
            return None
        return Outcome(
            OutcomeKind.REACHED, f"{self._text} and waited {self._task.wait_s:g} s", time
        )

    def unfinished(self, time: float) -> Outcome:
        """Return how it ends if the time of the run is over."""
        return Outcome(
            OutcomeKind.NOT_REACHED, "out of time before the output's wait was over", time
        )

    def events(self) -> tuple[tuple[float, str, str], ...]:
        """Return that the output was set, once."""
        if self._told or self._set_at is None:
            return ()
        self._told = True
        return ((self._set_at, "output", self._text),)

    @property
    def _text(self) -> str:
        return f"{self._task.output} set to {self._task.value:g}"
