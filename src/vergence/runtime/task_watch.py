"""Progress of the loop's task: what is lost, what holds the arm, and when the task is over."""

from vergence.arrays import FloatArray
from vergence.runtime import endings
from vergence.runtime.arrival import Arrival
from vergence.runtime.listeners import Listeners
from vergence.runtime.losses import LossReports
from vergence.runtime.stages import EndsTask, PlansAgain, Stages, Tells
from vergence.runtime.task_ends import Moment
from vergence.signals import JointCommand, Observation, Outcome, OutcomeKind, Reference


class TaskWatch:
    """Monitors one task, and notifies listeners of changes.

    Args:
        stages: the parts that perform the task.
        begun: when it began, s since the start of the run.
        rate_max: rate limits of the joints, (n,).
        listeners: to notify.
    """

    def __init__(
        self, stages: Stages, begun: float, rate_max: FloatArray, listeners: Listeners
    ) -> None:
        planner = stages.planner
        # Checked here once: an isinstance check of a protocol takes as long as a short tick's law.
        self._plans_again = planner if isinstance(planner, PlansAgain) else None
        self._tells = planner if isinstance(planner, Tells) else None
        self._ends = planner if isinstance(planner, EndsTask) else None
        self._until = stages.until
        self._begun, self._duration_s = begun, stages.duration_s
        self._listeners, self._losses = listeners, LossReports(listeners)
        self._arrival = None if stages.goal is None else Arrival(stages.goal, rate_max)
        self._stalled = False  # as last reported

    def end(self, duration_s: float) -> float:
        """Return when the time of the task is over, s, in a run of the given duration."""
        added = self._plans_again.added_s if self._plans_again else 0.0
        return min(duration_s, self._begun + self._duration_s + added)

    def see(self, time: float, observation: Observation) -> None:
        """Report what is lost and found again."""
        self._losses.report(time, observation)

    def judge(
        self,
        time: float,
        observation: Observation,
        reference: Reference,
        command: JointCommand,
        q: FloatArray,
    ) -> None:
        """Check the distance from the goal; report if the arm comes to rest before it."""
        self._tell_of_plans()
        if self._arrival is None:
            return
        self._arrival.observe(observation, reference, command, q)
        stalled = self._arrival.stalled
        if stalled != self._stalled:
            self._stalled = stalled
            text = f"held by {self._arrival.holder()}" if stalled else "the arm moves again"
            self._listeners.event(time, "stalled" if stalled else "moving", text)
            if stalled and self._plans_again:
                self._plans_again.stalled(time, self._arrival.points_px, q)

    def _tell_of_plans(self) -> None:
        if self._tells is not None:
            for event in self._tells.events():
                self._listeners.event(*event)

    def planned_end(self, time: float) -> Outcome | None:
        """Report the planner's events; return the outcome if the planner ends the task."""
        self._tell_of_plans()
        return None if self._ends is None else self._ends.conclusion(time)

    def asked_end(
        self, time: float, q: FloatArray, observation: Observation, reference: Reference
    ) -> Outcome | None:
        """Return the outcome of the task if its `until` ends it."""
        if self._until is None:
            return None
        return self._until.over(Moment(time, time - self._begun, q, observation, reference))

    def time_over(self, end: float, time: float) -> Outcome:
        """Return the outcome of a task whose time is over."""
        if self._ends is not None:
            return self._ends.unfinished(time)
        if self._until is not None:
            reason = "the time of the run is over before the task is"
            return Outcome(OutcomeKind.NOT_REACHED, reason, time)
        if self._arrival is None:
            return endings.completed(end, time)
        return self._arrival.outcome(end, time)
