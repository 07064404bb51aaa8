"""The one loop: driver, perception, planning, control, and back to the driver."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.control import InnerLaw, Law, Successor
from vergence.errors import DriverSilent, VergenceError
from vergence.raised import raised
from vergence.robot import Clearance
from vergence.runtime import endings
from vergence.runtime.arrival import Goal
from vergence.runtime.border import Border
from vergence.runtime.driver import Driver, ExactDriver
from vergence.runtime.endings import Fault
from vergence.runtime.following import FollowingBound
from vergence.runtime.guarded_arms import GuardedArms
from vergence.runtime.interrupt import Interrupt
from vergence.runtime.listener import Listener
from vergence.runtime.listeners import Listeners
from vergence.runtime.losses import may_move, reasons
from vergence.runtime.schedule import Schedule, command_share
from vergence.runtime.stages import Perception, Planner, Stages
from vergence.runtime.task_watch import TaskWatch
from vergence.runtime.tick import TickRecord
from vergence.runtime.timeouts import Timeouts
from vergence.signals import JointCommand, Observation, Outcome, OutcomeKind, Reference, Sample

_LOG = logging.getLogger(__name__)
_IMAGE_AGE_S = 0.5  # the smallest allowed limit on the age of an image on arrival


class Loop:
    """Runs one arm's task with a simulated or a real driver.

    Each inner tick reads a sample, checks it, and sends guarded set-points to the driver. An image
    is processed in the tick in which it arrives: perception, planner and law then determine new
    joint rates. An `InnerLaw` is asked for rates at each inner tick; those of any other law are
    held until the next image is due. If no image arrives, they fade to zero. With an `ExactDriver`,
    ticks in which nothing can happen are taken together, with the same result.

    Args:
        driver: the cell.
        arm: name of the arm that is moved; the others hold their position.
        perception: processes the images.
        planner: provides the desired features.
        law: computes the command.
        outer_rate_hz: rate at which images are due.
        listeners: are notified of every turn and event.
        timeouts: longest holds before the run ends.
        following: largest allowed distance of the arm from its set-points.
        goal: when the task counts as reached, and whether it ends there; not evaluated if None.
        next_stages: receives a task's outcome; returns the stages of the next task, or None to end
            the run with that outcome. Between tasks the arm is braked, and continues from its
            present set-points.
        clearance: distances between bodies that must not collide; None for no check.
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
        timeouts: Timeouts | None = None,
        following: FollowingBound | None = None,
        goal: Goal | None = None,
        next_stages: Callable[[Outcome], Stages | None] | None = None,
        clearance: Clearance | None = None,
    ) -> None:
        self._driver, self._arm = driver, arm
        self._timeouts = timeouts or Timeouts()
        self._next_stages = next_stages
        alone = isinstance(driver, ExactDriver) and len(driver.arms) == 1
        self._exact: ExactDriver | None = driver if alone else None  # type: ignore[assignment]
        self._period_s, self._half_tick_s = 1.0 / outer_rate_hz, 0.5 / driver.inner_rate_hz
        self._schedule = Schedule(driver.inner_rate_hz, outer_rate_hz)
        age_s = max(self._timeouts.image_s, _IMAGE_AGE_S)
        self._border = Border(driver, lambda: not self._arms.moving, age_s)
        self._listeners = Listeners(listeners)
        self._arms = GuardedArms(driver, arm, following or FollowingBound(), clearance)
        self._interrupt = Interrupt()
        self._part = "driver"  # the one at work, to be named if it raises
        self._rest = np.zeros(driver.arms[arm].joint_count)
        self._tick, self._now, self._end = 0, 0.0, np.inf
        self._held = ""  # kind of the last reported hold
        self.take_up(Stages(perception, planner, law, self._timeouts, goal))

    def take_up(self, stages: Stages) -> None:
        """Begin a task; the arm is held until an image arrives."""
        self._perception, self._planner, self._law = stages.perception, stages.planner, stages.law
        self._inner_law = stages.law if isinstance(stages.law, InnerLaw) else None
        self._timeouts, rate_max = stages.timeouts, self._driver.arms[self._arm].rate_max
        self._task = TaskWatch(stages, self._now, rate_max, self._listeners)
        self._last_image = self._last_seen = self._now  # s, of the last image, and with the target
        self._command: JointCommand | None = None  # that the arm executes; None while it is held

    def run(self, duration_s: float) -> Outcome:
        """Run until the time is over, the task has failed, or a signal arrives; then stop the arm.

        If a part raises, the arm is braked and the outcome states the error; the traceback goes to
        the log. If the driver does not accept set-points either, the robot's watchdog must stop the
        arm.
        """
        with self._interrupt:
            try:
                outcome = self._outcome(duration_s)
            except BaseException:
                self._arms.brake()
                raise
            outcome = self._braked(outcome)
        if not outcome.succeeded:
            self._listeners.event(outcome.time, outcome.kind.value, outcome.reason)
        return outcome

    @property
    def stopping(self) -> bool:
        """True once a signal came or `stop` was called; code waiting in the loop should return."""
        return self._interrupt.asked

    def stop(self) -> None:
        """End the run within this tick, as Ctrl-C does."""
        self._interrupt.asked = True

    @property
    def law(self) -> Law:
        """The present law."""
        return self._law

    def replace_law(self, law: Law) -> None:
        """Continue with another law from the next image.

        Until then the arm is held, unless the new law can take over from the old one. Must be
        called from the thread that runs the loop, for example by its driver.
        """
        if not (isinstance(law, Successor) and law.take_over(self._law)):
            self._command = None
        self._law = law
        self._inner_law = law if isinstance(law, InnerLaw) else None

    def _outcome(self, duration_s: float) -> Outcome:
        try:
            return self._run(duration_s)
        except KeyboardInterrupt:
            return self._stopped()
        except DriverSilent as silence:
            return Outcome(OutcomeKind.DRIVER_SILENT, str(silence), self._now)
        except VergenceError as error:  # its message suffices; a traceback would add nothing
            return self._raised(error)
        except Exception as error:
            _LOG.exception("the %s raised", self._part, extra={"in_outcome": True})
            return self._raised(error)

    def _run(self, duration_s: float) -> Outcome:
        while True:
            sample = self._border.admit(self._driver.read())
            if isinstance(sample, Fault):
                return Outcome(*sample, self._now)
            self._now = self._border.time
            if not self._arms.begun:
                # Compiled or loaded before anything moves.
                command_share(0.0, self._period_s, self._timeouts.decay_s)
                if fault := self._arms.begin(sample, self._timeouts.robot_s):
                    return Outcome(*fault, self._now)
            if self._interrupt.asked:
                return self._stopped()
            if outcome := self._turn(sample, duration_s):
                stages = self._next_stages(outcome) if self._next_stages else None
                if stages is None:
                    return outcome
                self.take_up(stages)
            if outcome := self._step(sample):
                return outcome

    def _turn(self, sample: Sample, duration_s: float) -> Outcome | None:
        """Process what arrived and decide how to continue; return the outcome if the run ends."""
        turns = self._schedule.turns(self._tick, bool(sample.frames))
        if self._schedule.period_over:
            stuck = self._arms.stuck()
            if self._tick and stuck:
                return endings.joint_limit(stuck, self._now)
        self._end = self._task.end(duration_s)
        if self._now > self._end - self._half_tick_s:
            return self._completed(self._end, sample)
        if not turns:
            return None
        sample = self._border.in_run_time(sample)
        self._part = "perception"
        observation = self._perception.observe(sample.frames)
        self._part = "planner"
        if observation is None:
            return self._wait(sample)
        self._last_image = self._now
        self._task.see(self._now, observation)
        reference = self._planner.reference(observation.time)
        self._part = "law"
        return self._decide(sample, observation, reference) or self._concluded(
            sample, observation, reference
        )

    def _concluded(
        self, sample: Sample, observation: Observation, reference: Reference
    ) -> Outcome | None:
        """Return the outcome if the task ends by its planner or its `until`."""
        self._part = "planner"
        if outcome := self._task.planned_end(self._now):
            return outcome
        self._part = "end of the task"
        q = sample.joints[self._arm].position
        return self._task.asked_end(self._now, q, observation, self._aimed(reference))

    def _wait(self, sample: Sample) -> Outcome | None:
        """Continue without an image, for a limited time."""
        waited = self._now - self._last_image
        if waited > self._timeouts.image_s:
            return endings.image_late(waited, self._now)
        self._record(sample, None, self._planner.reference(self._now))
        return None

    def _decide(
        self, sample: Sample, observation: Observation, reference: Reference
    ) -> Outcome | None:
        """Ask the law for a command, unless the target is lost or the arm is held."""
        self._command = None
        if not may_move(observation):
            self._record(sample, observation, reference)
            if self._now - self._last_seen > self._timeouts.target_s:
                return endings.target_lost(reasons(observation), self._now)
            return None
        self._last_seen = self._now
        if self._arms.moved.holding is not None:
            self._record(sample, observation, reference)
            return None
        joints = self._arms.moved.ahead(sample.joints[self._arm])
        command = self._law.command(observation, reference, joints)
        if fault := self._border.check_command(self._arm, command):
            return Outcome(*fault, self._now)
        self._command = command
        self._record(sample, observation, reference)
        q = sample.joints[self._arm].position
        self._task.judge(self._now, observation, reference, command, q)
        return None if command.fault is None else Outcome(*command.fault, self._now)

    def _step(self, sample: Sample) -> Outcome | None:
        """Send the next set-points to the driver; return the outcome if the run ends."""
        if fault := self._arms.observe(self._now, sample):
            return Outcome(*fault, self._now)
        self._tell_of_hold()
        rates = self._rates()
        if isinstance(rates, Fault):
            return Outcome(*rates, self._now)
        if not self._advanced(rates):
            setpoints = self._arms.step(rates)
            self._part = "driver"
            self._driver.step(setpoints)
            self._tick += 1
        hindrance = self._arms.moved.guard.hindrance
        return endings.collision(hindrance, self._now) if hindrance else None

    def _advanced(self, rates: FloatArray) -> bool:
        """Take all ticks until the next event together, if nothing can happen in them."""
        if self._exact is None or self._inner_law is not None:
            return False
        until_end = int((self._end - self._now) * self._driver.inner_rate_hz)
        due = self._schedule.ticks_left(self._tick)
        ticks = min(self._exact.quiet_ticks, due, until_end)
        last = self._now + (ticks - 1) / self._driver.inner_rate_hz
        if ticks < 2 or (self._command is not None and self._share_at(last) < 1.0):
            return False
        setpoints = self._arms.steps(rates, ticks)
        if setpoints is None:
            return False
        self._part = "driver"
        self._exact.advance(setpoints, ticks)
        self._tick += ticks
        return True

    def _rates(self) -> FloatArray | Fault:
        """Return the rates to execute: the command's, reduced according to its age."""
        share = self._share_at(self._now)
        self._part = "law"
        if share == 0.0:
            self._command = None
            if self._inner_law is not None:
                self._inner_law.hold()
            return self._rest
        assert self._command is not None
        rates = self._command.velocity
        if self._inner_law is not None:
            rates = self._inner_law.follow(self._arms.moved.guard.setpoint)
            if fault := self._border.check_rates(self._arm, rates):
                return fault
        return rates if share == 1.0 else share * rates

    def _share_at(self, time: float) -> float:
        """Return the fraction of the command that remains at a time."""
        if self._command is None:
            return 0.0
        return command_share(time - self._last_image, self._period_s, self._timeouts.decay_s)

    def _tell_of_hold(self) -> None:
        holding = self._arms.moved.holding
        kind = holding.kind.value if holding else ""
        if holding is not None:
            self._command = None
        if kind != self._held:
            self._held = kind
            reason = holding.reason if holding else f"{self._arm} follows again"
            self._listeners.event(self._now, kind or "following", reason)

    def _record(
        self, sample: Sample, observation: Observation | None, reference: Reference
    ) -> None:
        commands = {}
        if self._command is not None:
            share, asked = self._share_at(self._now), self._command
            faded = replace(asked, velocity=share * asked.velocity, v_camera=share * asked.v_camera)
            commands = {self._arm: asked if share == 1.0 else faded}
        aimed, setpoints = self._aimed(reference), self._arms.setpoints
        record = TickRecord(self._now, sample, observation, aimed, commands, setpoints)
        self._listeners.tick(record)

    def _aimed(self, reference: Reference) -> Reference:
        """Return the reference as far as the law's features determine it."""
        return (self._command and self._command.reference) or reference

    def _completed(self, end: float, sample: Sample) -> Outcome:
        measured = sample.joints[self._arm].position
        if hindered := self._arms.moved.hindered(self._now, measured):
            return Outcome(*hindered, self._now)
        return self._task.time_over(end, self._now)

    def _raised(self, error: Exception) -> Outcome:
        reason = f"the {self._part} raised {raised(error)}"
        return Outcome(OutcomeKind.PART_RAISED, reason, self._now)

    def _stopped(self) -> Outcome:
        return Outcome(OutcomeKind.STOPPED, self._interrupt.reason, self._now)

    def _braked(self, outcome: Outcome) -> Outcome:
        """Brake every arm; if the driver becomes silent meanwhile, that is the outcome."""
        failure = self._arms.brake()
        if not failure or outcome.kind is OutcomeKind.DRIVER_SILENT:
            return outcome
        if outcome.succeeded or outcome.kind is OutcomeKind.STOPPED:
            return Outcome(OutcomeKind.DRIVER_SILENT, failure, self._now)
        return replace(outcome, reason=f"{outcome.reason}; not braked from here: {failure}")
