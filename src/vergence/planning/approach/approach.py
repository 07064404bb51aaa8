"""Brings a camera to where a photograph was taken: perception and planner in one."""

from dataclasses import replace

import numpy as np

from vergence.estimation.goal_fit import points_in
from vergence.planning.approach.answers import Answer, Arrived, Told, view_of
from vergence.planning.approach.closing import Closing
from vergence.planning.approach.finisher import Finisher
from vergence.planning.approach.goal import ApproachSettings, GoalImage
from vergence.planning.approach.kept_images import with_tracks
from vergence.planning.approach.recognition import Recognition
from vergence.planning.approach.search import Plan, Search
from vergence.planning.approach.worker import Worker
from vergence.planning.failure import PlanFailure
from vergence.planning.path import Path
from vergence.planning.trajectory import Trajectory
from vergence.robot import Arm
from vergence.signals import Frame, ImagePoints, Observation, Outcome, OutcomeKind, Reference
from vergence.vision import SsdTracker, TwoViewFailure
from vergence.vision.tracks import Tracks

_FEWEST = 6  # tracked points, below which the photograph is searched for again
_AGAIN_S = 0.7  # between two searches for the photograph
_LOOKS = 4  # consecutive failed searches before the task ends
_SETTLE_S = 1.5  # after the path, before the photograph is searched for again
_HALFWAY = 0.6  # fraction of the path at which the photograph is searched for again


class Approach:
    """Recognises a photograph, plans a path to where it was taken, follows it and arrives.

    While the camera moves, tracked points and the arm's joints determine the scale and which of
    several motions is right (`fit_goal`); the path is replanned if it contradicts them. On the way,
    and when too few points are left, the photograph is searched for again. At the end, windows of
    the photograph itself are tracked, which eliminates drift.

    Args:
        goal: the photograph.
        camera: name of the camera to bring there.
        carrier: name of the arm that carries it.
        arm: that arm, up to the camera.
        plan: finds a path.
        settings: see `ApproachSettings`.
        worker: runs jobs that take longer than an image.
    """

    def __init__(
        self,
        goal: GoalImage,
        camera: str,
        carrier: str,
        arm: Arm,
        plan: Plan,
        settings: ApproachSettings,
        worker: Worker,
    ) -> None:
        self._goal, self._camera, self._carrier = goal, camera, carrier
        self._settings, self._worker = settings, worker
        self._search = Search(goal, carrier, arm, plan, settings)
        self._closing = Closing(goal, settings)
        self._recognition: Recognition | None = None
        self._tracker: SsdTracker | None = None
        self._trajectory: Trajectory | None = None
        self._began = 0.0  # s, start of the trajectory
        self._looked = 0.0  # s, last search for the photograph
        self._failures = 0  # consecutive searches that found nothing
        self._stays = 0  # searches while the camera was at rest, but not certainly at the goal
        self._halfway_done = False
        self._fitted_at = 1  # number of images in the last fit
        self._outcome: Outcome | None = None
        self._told: list[Told] = []

    def begin(self, frame: Frame) -> Trajectory | PlanFailure | TwoViewFailure:
        """Recognise the photograph from the start and plan, or return why not, before moving."""
        answer = self._search.first(frame)
        if not isinstance(answer, Answer):
            return answer
        self._take(answer, frame)
        assert self._trajectory is not None
        return self._trajectory

    @property
    def recognition(self) -> Recognition | None:
        """What is known about the photograph."""
        return self._recognition

    @property
    def trajectory(self) -> Trajectory | None:
        """The path being followed."""
        return self._trajectory

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return the tracked points in the images that arrived."""
        views = [self._view(f) for f in frames if f.camera == self._camera and f.image is not None]
        if not views:
            return None
        return Observation(views[-1].time, (views[-1],))

    def reference(self, time: float) -> Reference:
        """Return the path at a time, or the photograph's points once they are tracked."""
        if self._closing.begun:
            assert self._closing.points is not None
            return self._closing.points.reference(time)
        assert self._trajectory is not None
        return replace(self._trajectory.reference(time - self._began), time=time)

    def conclusion(self, time: float) -> Outcome | None:
        """Return the outcome of the task once it has ended."""
        return self._outcome

    def unfinished(self, time: float) -> Outcome:
        """Return the outcome of the task if its time is over."""
        return self._closing.unfinished(time)

    def events(self) -> list[Told]:
        """Return the events since the last call."""
        told, self._told = self._told, []
        return told

    def _view(self, frame: Frame) -> ImagePoints:
        """Track the points into an image, and start a new search if one is due."""
        answer = self._worker.answer()
        if answer is not None:
            self._take(answer, frame)
        tracks = self._tracked(frame)
        if not self._worker.busy:
            closing = self._closing.begun
            self._consider(frame, tracks)
            answer = self._worker.answer()
            taken = answer is not None and self._take(answer, frame)
            if taken or self._closing.begun != closing:
                tracks = self._tracked(frame)
        return view_of(frame, tracks)

    def _tracked(self, frame: Frame) -> Tracks:
        assert frame.image is not None
        assert self._tracker is not None
        if self._closing.begun:
            tracks = self._closing.tracks(frame, self._search.camera_pose(frame))
            if fault := self._closing.hand_back():
                self._tell(frame.time, "luminance hands back", fault)
            if tracks is not None:
                return tracks
            self._tell(frame.time, "left the goal", "the photograph's points are lost")
        return self._tracker.track(frame.image)

    def _consider(self, frame: Frame, tracks: Tracks) -> None:
        """Start the job that the image calls for, if any."""
        if self._closing.begun:
            self._judge(frame)
            return
        assert self._trajectory is not None
        assert self._recognition is not None
        time, found = frame.time - self._began, tracks.found
        share = time / self._trajectory.duration
        T = self._search.camera_pose(frame)
        if found.sum() >= _FEWEST:
            self._recognition = with_tracks(self._recognition, self._goal, T, tracks)
        if share >= 1.0 and (many := self._closing.begin(self._recognition.fit, T, frame)):
            self._tell(frame.time, "arriving", f"{many} points of the goal image are followed")
            return
        halfway = share >= _HALFWAY and not self._halfway_done
        over = time > self._trajectory.duration + _SETTLE_S
        if self._due(frame) and (over or halfway or found.sum() < _FEWEST):
            self._halfway_done = self._halfway_done or halfway
            self._look(frame)
        elif len(self._recognition.images) >= 1.6 * self._fitted_at + 1:
            self._fitted_at = len(self._recognition.images)
            known, leads_to = self._recognition, self._trajectory.path.problem.T_world_goal
            self._worker.ask(lambda: self._search.checked(known.fitted(), frame, leads_to, False))

    def _judge(self, frame: Frame) -> None:
        """Conclude once the camera is certainly at the goal."""
        displacement = self._closing.at_rest()
        if displacement is None:
            return
        if job := self._closing.arrived(displacement, frame):
            self._worker.ask(self._closing.finish() or job)
        elif self._closing.finisher is not None:
            return  # it hands back with the next image
        elif self._stays >= _LOOKS:
            reason = f"at rest at {self._closing.where(displacement)}{self._closing.remark}"
            self._outcome = Outcome(OutcomeKind.NOT_REACHED, reason, frame.time)
        elif self._due(frame):
            self._stays += 1
            self._look(frame)

    def _due(self, frame: Frame) -> bool:
        return frame.time - self._looked >= _AGAIN_S

    def _look(self, frame: Frame) -> None:
        """Search for the photograph again."""
        assert self._recognition is not None
        assert self._trajectory is not None
        self._looked = frame.time
        known, leads_to = self._recognition, self._trajectory.path.problem.T_world_goal
        self._worker.ask(lambda: self._search.again(known, frame, leads_to))

    def _take(self, answer: Answer | Arrived | Finisher, frame: Frame) -> bool:
        """Apply the result of a job; return whether other points are tracked from now on."""
        if isinstance(answer, Finisher):
            self._closing.finisher = answer
            self._tell(frame.time, "luminance takes over", "the points have arrived")
            return False
        if isinstance(answer, Arrived):
            self._outcome = answer.outcome(frame.time)
            return False
        found = answer.recognition
        if isinstance(found, TwoViewFailure):
            self._not_recognised(found, frame)
            return False
        self._failures = 0
        self._closing.scale_deviation = min(self._closing.scale_deviation, found.depth_deviation)
        if isinstance(answer.path, PlanFailure):
            reason = f"no path leads on from here: {answer.path.reason}"
            self._outcome = Outcome(OutcomeKind.NOT_REACHED, reason, frame.time)
            return False
        before = self._recognition
        self._recognition = found
        if answer.new_points:
            self._follow_points(found, frame)
        elif before is not None:  # images may have arrived meanwhile
            self._recognition = replace(found, images=before.images)
        if answer.path is not None:
            self._follow_path(answer.path, found, frame)
        return answer.new_points

    def _not_recognised(self, failure: TwoViewFailure, frame: Frame) -> None:
        self._failures += 1
        self._tell(frame.time, "not recognised", str(failure))
        if self._failures >= _LOOKS:
            reason = f"the goal image is no longer recognised: {failure.reason}"
            self._outcome = Outcome(OutcomeKind.NOT_REACHED, reason, frame.time)

    def _follow_points(self, found: Recognition, frame: Frame) -> None:
        """Track other points from now on.

        They are first located in the newest image, which may be much later than the one they are
        from.
        """
        assert frame.image is not None
        self._tracker = SsdTracker(found.image, found.points_px)
        self._closing.take(found)
        self._fitted_at = 1
        if found.image is frame.image:
            return
        seen = points_in(self._search.camera_pose(frame), found.fit.points_world)
        if (seen[:, 2] > 0).all():
            self._tracker.track(frame.image, self._goal.camera.project(seen))

    def _follow_path(self, path: Path, found: Recognition, frame: Frame) -> None:
        """Follow a path from the point that is nearest to the arm."""
        self._trajectory = Trajectory.of(path, self._settings.camera_speed_m_s)
        duration, q = self._trajectory.duration, frame.joints[self._carrier]
        times = np.linspace(0.0, 0.5 * duration, 50)
        away = [float(np.abs(self._trajectory.joints(t)[0] - q).max()) for t in times]
        self._began = frame.time - float(times[int(np.argmin(away))])
        rivals = "" if found.certain else f"; {len(found.fits)} motions possible"
        text = (
            f"{path.camera_length_m:.3f} m in {duration:.1f} s, by {len(found.recognised_px)} "
            f"points, scale known to {100 * self._closing.scale_deviation:.0f} %{rivals}"
        )
        self._tell(frame.time, "path planned", text)

    def _tell(self, time: float, name: str, text: str) -> None:
        self._told.append(Told(time, name, text))
