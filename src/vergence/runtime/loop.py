"""The one loop: driver, perception, planning, control, and back to the driver."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import picture_tick
from vergence.control import Guard, InnerLaw, Law
from vergence.errors import DriverSilent
from vergence.runtime import endings
from vergence.runtime.driver import Driver
from vergence.runtime.interrupt import Interrupt
from vergence.runtime.listener import Listener
from vergence.runtime.listeners import Listeners
from vergence.runtime.stages import Perception, Planner
from vergence.runtime.stopping import brake, raised
from vergence.runtime.tick import TickRecord
from vergence.signals import (
    ImagePoints,
    JointCommand,
    Observation,
    Outcome,
    OutcomeKind,
    Reference,
    Sample,
    Setpoint,
)

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Patience:
    """How long the loop holds the arm still and hopes before it ends the run."""

    image_s: float = 0.5  # without any picture
    target_s: float = 0.2  # with pictures, but none of the features found


class Loop:
    """Runs one arm's task; simulated or real is the driver's business.

    Each outer tick reads the cell, looks, and asks the law for joint rates; each inner tick hands a
    guarded set-point to the driver, so that whatever the law says no joint passes its limits. An
    `InnerLaw` is asked for new rates at each inner tick, any other keeps them between pictures.

    Args:
        driver: the cell.
        arm: name of the arm that is moved; the others hold their place.
        perception: looks at the pictures.
        planner: says what is wanted.
        law: says how to get there.
        outer_rate_hz: how often to look.
        listeners: hear of every tick and event.
        patience: how long to hold before giving up.
    """

    def __init__(
        self,
        driver: Driver,
        arm: str,
        perception: Perception,
        planner: Planner,
        law: Law,
        *,
        outer_rate_hz: float,
        listeners: Sequence[Listener] = (),
        patience: Patience | None = None,
    ) -> None:
        self._driver, self._arm = driver, arm
        self._perception, self._planner, self._law = perception, planner, law
        self._outer_rate_hz = outer_rate_hz
        self._listeners = Listeners(listeners)
        self._part = "driver"  # the one at work, to be named if it raises
        self._patience = patience or Patience()
        dt = 1.0 / driver.inner_rate_hz
        self._first = driver.read()
        self._guards = {
            name: Guard(arm, self._first.joints[name].position, dt)
            for name, arm in driver.arms.items()
        }
        self._interrupt = Interrupt()
        self._still = np.zeros(driver.arms[arm].joint_count)
        self._inner_tick = 0
        self._last_picture = self._last_seen = 0.0
        self._lost: dict[str, set[int]] = {}  # features, by camera
        self._target_lost = False
        self._last_command: JointCommand | None = None

    def run(self, duration_s: float) -> Outcome:
        """Run until the time is over, the task has failed, or a signal; then stop the arm.

        Whatever a part raises, the arm is braked and the outcome says so; the traceback goes to the
        log. An arm whose driver is silent cannot be stopped from here: its own watchdog does that.
        """
        with self._interrupt:
            try:
                outcome = self._outcome(duration_s)
            except BaseException:
                brake(self._driver, self._guards)
                raise
            if outcome.kind is not OutcomeKind.DRIVER_SILENT:
                outcome = self._braked(outcome)
        if not outcome.succeeded:
            self._listeners.event(outcome.time, outcome.kind.value, outcome.reason)
        return outcome

    @property
    def stopping(self) -> bool:
        """Whether Ctrl-C was pressed or `stop` called: who waits inside the loop should not."""
        return self._interrupt.asked

    def stop(self) -> None:
        """End the run within this tick, as Ctrl-C does."""
        self._interrupt.asked = True

    def replace_law(self, law: Law) -> None:
        """Go on with another law from the next picture; until then the arm is held.

        To be called from the thread that runs the loop, such as by its driver.
        """
        self._law, self._last_command = law, None

    def _outcome(self, duration_s: float) -> Outcome:
        try:
            return self._run(duration_s)
        except KeyboardInterrupt:
            return self._stopped()
        except DriverSilent as silence:
            return Outcome(OutcomeKind.DRIVER_SILENT, str(silence), self._now)
        except Exception as error:
            _LOG.exception("the %s raised", self._part)
            return Outcome(OutcomeKind.PART_RAISED, raised(self._part, error), self._now)

    def _braked(self, outcome: Outcome) -> Outcome:
        """Brake every arm; a driver that falls silent meanwhile is the outcome instead."""
        failure = brake(self._driver, self._guards)
        if not failure:
            return outcome
        if outcome.succeeded or outcome.kind is OutcomeKind.STOPPED:
            return Outcome(OutcomeKind.DRIVER_SILENT, failure, self._now)
        return replace(outcome, reason=f"{outcome.reason}; not braked from here: {failure}")

    def _run(self, duration_s: float) -> Outcome:
        outer_tick, sample = 0, self._first
        while True:
            if self._interrupt.asked:
                return self._stopped()
            if sample.time >= duration_s:
                return endings.completed(duration_s, sample.time)
            self._part = "perception"
            observation = self._perception.observe(sample.frames)
            command, outcome = self._decide(sample, observation)
            if outcome is not None:
                return outcome
            outer_tick += 1
            next_tick = picture_tick(outer_tick, self._driver.inner_rate_hz, self._outer_rate_hz)
            self._part = "driver"
            if limited := self._move(self._rates(command), next_tick):
                return endings.joint_limit(limited, self._now)
            sample = self._driver.read()

    def _stopped(self) -> Outcome:
        return Outcome(OutcomeKind.STOPPED, self._interrupt.reason, self._now)

    @property
    def _now(self) -> float:
        return self._inner_tick / self._driver.inner_rate_hz

    def _decide(
        self, sample: Sample, observation: Observation | None
    ) -> tuple[JointCommand | None, Outcome | None]:
        """Return the command for the next period, None to hold, or how the run ends."""
        time = sample.time
        if observation is None:
            if time - self._last_picture > self._patience.image_s:
                return None, endings.image_late(time - self._last_picture, time)
            self._record(sample, None, self._planner.reference(time), self._last_command)
            return self._last_command, None
        self._last_picture = time
        self._report_losses(time, observation)
        self._part = "planner"
        reference = self._planner.reference(observation.time)
        if not _shows_target(observation):
            self._last_command = None
            self._record(sample, observation, reference, None)
            if time - self._last_seen > self._patience.target_s:
                return None, endings.target_lost(_reasons(observation), time)
            return None, None
        self._last_seen = time
        self._part = "law"
        command = self._law.command(observation, reference, sample.joints[self._arm])
        self._last_command = command
        self._record(sample, observation, reference, command)
        if command.fault is not None:
            return None, Outcome(*command.fault, time)
        return command, None

    def _rates(self, command: JointCommand | None) -> Callable[[Setpoint], FloatArray]:
        """Return what says, given the last set-point, how fast it shall move."""
        law = self._law
        if isinstance(law, InnerLaw):
            if command is not None:
                return law.follow
            law.hold()
        rates = self._still if command is None else command.velocity
        return lambda _: rates

    def _move(self, rates: Callable[[Setpoint], FloatArray], until_tick: int) -> list[str]:
        """Step the driver to an inner tick; return the joints stuck at a limit all the while."""
        guard = self._guards[self._arm]
        stuck = np.ones(guard.joint_count, dtype=np.bool_)
        while self._inner_tick < until_tick and not self._interrupt.asked:
            wanted = rates(guard.setpoint)
            setpoints = {
                name: other.step(wanted if name == self._arm else np.zeros(other.joint_count))
                for name, other in self._guards.items()
            }
            stuck &= guard.at_limit
            self._driver.step(setpoints)
            self._inner_tick += 1
        if self._interrupt.asked:
            return []
        names = self._driver.arms[self._arm].names
        return [name for name, at_limit in zip(names, stuck, strict=True) if at_limit]

    def _record(
        self,
        sample: Sample,
        observation: Observation | None,
        reference: Reference,
        command: JointCommand | None,
    ) -> None:
        commands = {} if command is None else {self._arm: command}
        setpoints = {name: guard.setpoint for name, guard in self._guards.items()}
        record = TickRecord(sample.time, sample, observation, reference, commands, setpoints)
        self._listeners.tick(record)

    def _report_losses(self, time: float, observation: Observation) -> None:
        lost = not _shows_target(observation)
        if lost != self._target_lost:
            self._target_lost = lost
            text = endings.why_lost(_reasons(observation)) if lost else "it is back"
            self._listeners.event(time, "target out of sight" if lost else "target in sight", text)
        if observation.target is None and not lost:
            for view in {view.camera: view for view in observation.views}.values():
                self._report_features(time, view)

    def _report_features(self, time: float, view: ImagePoints) -> None:
        before = self._lost.get(view.camera, set())
        lost = set(np.flatnonzero(~view.found).tolist())
        for feature in sorted(lost - before):
            text = f"feature {feature} in {view.camera}: {view.reasons[feature]}"
            self._listeners.event(time, "feature lost", text)
        for feature in sorted(before - lost):
            self._listeners.event(
                time, "feature found", f"feature {feature} in {view.camera} is back"
            )
        self._lost[view.camera] = lost


def _shows_target(observation: Observation) -> bool:
    return bool(observation.target) or any(view.found.any() for view in observation.views)


def _reasons(observation: Observation) -> list[str]:
    return [reason for view in observation.views for reason in view.reasons]
