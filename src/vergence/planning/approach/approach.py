"""Brings a camera to where a photograph was taken: perception and planner in one."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.estimation.displacement import Displacement
from vergence.estimation.goal_fit import GoalFit, Prior, points_in, pose_difference
from vergence.geometry import se3_inverse
from vergence.planning.approach.answers import Answer, Arrived, Told, in_words, view_of
from vergence.planning.approach.arrival import GoalPoints
from vergence.planning.approach.goal import ApproachSettings, GoalImage
from vergence.planning.approach.recognition import (
    KNOWN,
    ROUGH,
    ROUGH_M,
    UNKNOWN,
    Recognition,
    confirm,
    length_ratio,
    recognise,
    tracked_image,
)
from vergence.planning.approach.worker import Worker
from vergence.planning.failure import PlanFailure
from vergence.planning.path import Path
from vergence.planning.problem import PlanningProblem
from vergence.planning.trajectory import Trajectory
from vergence.robot import Arm
from vergence.signals import Frame, ImagePoints, Observation, Outcome, OutcomeKind, Reference
from vergence.vision import SsdTracker, TwoViewFailure
from vergence.vision.tracks import Tracks

Plan = Callable[[PlanningProblem], Path | PlanFailure]

_PARALLAX = 0.03  # of the object's distance, or rad, that the camera moves between two images kept
_MOST_IMAGES = 20
_CONTRADICTION = 22.5  # χ² with 6 degrees of freedom, one in a thousand
_OFF, _OFF_M, _OFF_RAD = 0.1, 3e-3, 0.02  # share of the rest of the way, and lengths, to plan anew
_FEWEST = 6  # points found, below which the photograph is looked for again
_AGAIN_S = 0.7  # between two looks for the photograph
_LOOKS = 4  # in a row without success
_NEAR_PX = 32.0  # of the photograph's points from their places, at which they are followed
_SETTLE_S = 1.5  # after the path, before the photograph is looked for again
_HALFWAY = 0.6  # share of the path at which the photograph is looked for again


class Approach:
    """Recognises a photograph, plans a path to where it was taken, follows it and arrives.

    While the camera moves, tracked points and the arm's joints tell the scale and which of several
    motions is right (`fit_goal`); the path is planned anew where it contradicts them. On the way,
    and where too few points are left, the photograph is looked for again. At the end its own
    windows are tracked, so that nothing has drifted.

    Args:
        goal: the photograph.
        camera: name of the camera that is to be brought there.
        carrier: name of the arm that carries it.
        arm: that arm, up to the camera.
        plan: finds a path.
        settings: see `ApproachSettings`.
        worker: does what takes longer than an image.
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
        self._arm, self._plan, self._settings, self._worker = arm, plan, settings, worker
        self._recognition: Recognition | None = None
        self._tracker: SsdTracker | None = None
        self._trajectory: Trajectory | None = None
        self._began = 0.0  # s, when the trajectory began
        self._goal_points: GoalPoints | None = None
        self._arriving = False  # whether the photograph's own points are followed
        self._scale_deviation = 1.0  # relative, of all lengths; the least so far
        self._looked = 0.0  # s, when the photograph was looked for last
        self._failures = 0  # looks in a row that found nothing
        self._stays = 0  # looks because the camera is at rest, but not surely at the goal
        self._halfway_done = False
        self._fitted_at = 1  # images in the last fit
        self._outcome: Outcome | None = None
        self._told: list[Told] = []

    def begin(self, frame: Frame) -> Trajectory | PlanFailure | TwoViewFailure:
        """Recognise the photograph from the start and plan; or say why not, before a move."""
        settings = self._settings
        deviation = UNKNOWN if settings.distance_m is None else ROUGH
        prior = Prior(np.array([settings.distance_m or ROUGH_M]), deviation)
        assert frame.image is not None
        T = self._camera_pose(frame)
        found = recognise(self._goal, frame.image, T, settings.points, prior)
        if isinstance(found, Recognition) and settings.length is not None:
            assert prior.depth_m is not None
            ratio = length_ratio(settings.length, self._goal, found.fit)
            prior = Prior(ratio * prior.depth_m, KNOWN)
            found = recognise(self._goal, frame.image, T, settings.points, prior)
        if isinstance(found, TwoViewFailure):
            return found
        path = self._plan(self._problem(found.fit, frame))
        if isinstance(path, PlanFailure):
            return path
        self._take(Answer(found, path, True), frame)
        assert self._trajectory is not None
        return self._trajectory

    @property
    def recognition(self) -> Recognition | None:
        """What is known of the photograph."""
        return self._recognition

    @property
    def trajectory(self) -> Trajectory | None:
        """The path that is followed."""
        return self._trajectory

    @property
    def goal_points(self) -> GoalPoints | None:
        """The photograph's own points."""
        return self._goal_points

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return the points followed in the images that arrived."""
        views = [self._view(f) for f in frames if f.camera == self._camera and f.image is not None]
        if not views:
            return None
        return Observation(views[-1].time, (views[-1],))

    def reference(self, time: float) -> Reference:
        """Return the path at a time, or the photograph's points once they are followed."""
        if self._arriving:
            assert self._goal_points is not None
            return self._goal_points.reference(time)
        assert self._trajectory is not None
        return replace(self._trajectory.reference(time - self._began), time=time)

    def conclusion(self, time: float) -> Outcome | None:
        """Return how the task ends, once it does."""
        return self._outcome

    def unfinished(self, time: float) -> Outcome:
        """Return how the task ends if its time is over."""
        displacement = self._goal_points.displacement if self._goal_points else None
        if self._arriving and displacement is not None:
            where = in_words(displacement.distance_m, displacement.angle_rad)
            far = in_words(*self._at_most(displacement))
            reason = f"its time is over at {where} from the goal; sure within {far}"
        else:
            reason = "its time is over on the way"
        return Outcome(OutcomeKind.NOT_REACHED, reason, time)

    def events(self) -> list[Told]:
        """Return what happened since the last call."""
        told, self._told = self._told, []
        return told

    def _camera_pose(self, frame: Frame) -> FloatArray:
        return self._arm.forward_kinematics(frame.joints[self._carrier])

    def _problem(self, fit: GoalFit, frame: Frame) -> PlanningProblem:
        settings, q = self._settings, frame.joints[self._carrier]
        return PlanningProblem(
            self._arm,
            self._goal.camera,
            q,
            fit.T_world_goal,
            fit.points_world,
            settings.margin_px,
            settings.margin_joint,
        )

    def _view(self, frame: Frame) -> ImagePoints:
        """Follow the points into an image, and look again where that is due."""
        answer = self._worker.answer()
        if answer is not None:
            self._take(answer, frame)
        tracks = self._tracked(frame)
        if not self._worker.busy:
            arriving = self._arriving
            self._consider(frame, tracks)
            answer = self._worker.answer()
            taken = answer is not None and self._take(answer, frame)
            if taken or self._arriving != arriving:
                tracks = self._tracked(frame)
        return view_of(frame, tracks)

    def _tracked(self, frame: Frame) -> Tracks:
        assert frame.image is not None
        assert self._tracker is not None
        if self._arriving:
            assert self._goal_points is not None
            tracks = self._goal_points.track(frame.image, frame.time)
            if tracks is not None:
                return tracks
            self._arriving = False
            self._tell(frame.time, "left the goal", "the photograph's points are lost")
        return self._tracker.track(frame.image)

    def _consider(self, frame: Frame, tracks: Tracks) -> None:
        """Ask for what the image gives reason to."""
        if self._arriving:
            self._judge(frame)
            return
        assert self._trajectory is not None
        assert self._recognition is not None
        time, found = frame.time - self._began, tracks.found
        share = time / self._trajectory.duration
        due = frame.time - self._looked >= _AGAIN_S
        if found.sum() >= _FEWEST:
            self._keep(frame, tracks)
        if share >= 1.0 and self._arrives(frame):
            return
        halfway = share >= _HALFWAY and not self._halfway_done
        over = time > self._trajectory.duration + _SETTLE_S
        if due and (over or halfway or found.sum() < _FEWEST):
            self._halfway_done = self._halfway_done or halfway
            self._looked = frame.time
            self._worker.ask(lambda: self._look(frame))
        elif len(self._recognition.images) >= 1.6 * self._fitted_at + 1:
            self._fitted_at = len(self._recognition.images)
            known = self._recognition
            self._worker.ask(lambda: self._checked(known.fitted(), frame, False))

    def _keep(self, frame: Frame, tracks: Tracks) -> None:
        """Keep an image that was taken from elsewhere than the ones before."""
        assert self._recognition is not None
        known, T = self._recognition, self._camera_pose(frame)
        distance = float(np.median(points_in(T, known.fit.points_world)[:, 2]))
        moves = (pose_difference(T, image.T_world_camera) for image in known.images)
        near = any(
            np.linalg.norm(d[:3]) < _PARALLAX * distance and np.linalg.norm(d[3:]) < _PARALLAX
            for d in moves
        )
        if near or len(known.images) >= _MOST_IMAGES or len(known.star_px) != len(tracks.found):
            return
        image = tracked_image(self._goal, T, tracks.points_px, tracks.covariance_px, tracks.found)
        self._recognition = known.with_image(image)

    def _look(self, frame: Frame) -> Answer:
        """Look for the photograph again."""
        assert self._recognition is not None
        assert frame.image is not None
        known = self._recognition.fitted()
        prior = known.prior
        if prior.depth_m is None:
            prior = Prior(np.array([1.0]), UNKNOWN)
        T, count = self._camera_pose(frame), self._settings.points
        found = recognise(self._goal, frame.image, T, count, prior, known.fit)
        if isinstance(found, TwoViewFailure):
            return Answer(found, None, False)
        return self._checked(found, frame, True)

    def _checked(self, known: Recognition, frame: Frame, new_points: bool) -> Answer:
        """Plan anew if the path leads elsewhere, or other points are followed."""
        assert self._trajectory is not None
        contradicted = self._contradicted(known, frame)
        if not (contradicted or new_points):
            return Answer(known, None, False)
        return Answer(known, self._plan(self._problem(known.fit, frame)), new_points)

    def _contradicted(self, known: Recognition, frame: Frame) -> bool:
        assert self._trajectory is not None
        fit, planned = known.fit, self._trajectory.path.problem.T_world_goal
        off = pose_difference(fit.T_world_goal, planned)
        sure = off @ np.linalg.solve(fit.covariance, off) > _CONTRADICTION
        rest = float(np.linalg.norm(fit.T_world_goal[:3, 3] - self._camera_pose(frame)[:3, 3]))
        far = float(np.linalg.norm(off[:3])) > max(_OFF * rest, _OFF_M)
        return bool(sure and (far or np.linalg.norm(off[3:]) > _OFF_RAD))

    def _take(self, answer: Answer | Arrived, frame: Frame) -> bool:
        """Go by the answer of a job; return whether other points are followed from now on."""
        if isinstance(answer, Arrived):
            self._outcome = answer.outcome(frame.time)
            return False
        found = answer.recognition
        if isinstance(found, TwoViewFailure):
            self._failures += 1
            self._tell(frame.time, "not recognised", str(found))
            if self._failures >= _LOOKS:
                reason = f"the goal image is not recognised any more: {found.reason}"
                self._outcome = Outcome(OutcomeKind.NOT_REACHED, reason, frame.time)
            return False
        self._failures = 0
        self._scale_deviation = min(self._scale_deviation, found.depth_deviation)
        if isinstance(answer.path, PlanFailure):
            self._outcome = replace(answer.path.outcome(frame.time), kind=OutcomeKind.NOT_REACHED)
            return False
        before = self._recognition
        self._recognition = found
        if answer.new_points:
            self._tracker = SsdTracker(found.image, found.points_px)
            self._goal_points = GoalPoints(self._goal, found.recognised_px)
            self._arriving = False
            self._fitted_at = 1
            if found.image is not frame.image:
                self._catch_up(found, frame)
        elif before is not None:  # images may have come meanwhile
            self._recognition = replace(found, images=before.images)
        if answer.path is not None:
            self._follow(answer.path, frame)
            self._tell(frame.time, "path planned", self._planned_text(found))
        return answer.new_points

    def _catch_up(self, found: Recognition, frame: Frame) -> None:
        """Find the points in the newest image, which may be much later than theirs."""
        assert self._tracker is not None
        assert frame.image is not None
        seen = points_in(self._camera_pose(frame), found.fit.points_world)
        if (seen[:, 2] > 0).all():
            self._tracker.track(frame.image, self._goal.camera.project(seen))

    def _planned_text(self, found: Recognition) -> str:
        assert self._trajectory is not None
        length, count = self._trajectory.path.camera_length_m, len(found.recognised_px)
        rivals = "" if found.certain else f"; {len(found.fits)} motions possible"
        return (
            f"{length:.3f} m in {self._trajectory.duration:.1f} s, by {count} points, "
            f"scale known to {100 * self._scale_deviation:.0f} %{rivals}"
        )

    def _follow(self, path: Path, frame: Frame) -> None:
        """Follow a path from where it is nearest to the arm."""
        self._trajectory = Trajectory.of(path, self._settings.camera_speed_m_s)
        times = np.linspace(0.0, 0.5 * self._trajectory.duration, 50)
        q = frame.joints[self._carrier]
        away = [float(np.abs(self._trajectory.joints(t)[0] - q).max()) for t in times]
        self._began = frame.time - float(times[int(np.argmin(away))])

    def _arrives(self, frame: Frame) -> bool:
        """Follow the photograph's own points, if they are found where they are expected."""
        assert self._goal_points is not None
        assert self._recognition is not None
        assert frame.image is not None
        fit = self._recognition.fit
        self._goal_points.learn(fit)
        T_goal_camera = se3_inverse(fit.T_world_goal) @ self._camera_pose(frame)
        if self._goal_points.shift_px(T_goal_camera) > _NEAR_PX:
            return False
        tracks = self._goal_points.track(frame.image, frame.time, T_goal_camera)
        if tracks is None:
            return False
        self._arriving = True
        found = f"{np.count_nonzero(tracks.found)} of {len(tracks.found)}"
        self._tell(frame.time, "arriving", f"{found} points of the goal image are followed")
        return True

    def _judge(self, frame: Frame) -> None:
        """Conclude once the camera is at the goal for sure."""
        assert self._goal_points is not None
        displacement, settings = self._goal_points.displacement, self._settings
        if displacement is None or not self._goal_points.at_rest(
            settings.tolerance_m, settings.tolerance_rad
        ):
            return
        far_m, far_rad = self._at_most(displacement)
        where = in_words(displacement.distance_m, displacement.angle_rad)
        reason = f"{where} from the goal; sure within {in_words(far_m, far_rad)}"
        if far_m <= settings.tolerance_m and far_rad <= settings.tolerance_rad:
            image = frame.image
            assert image is not None
            self._worker.ask(lambda: Arrived(confirm(self._goal, image), reason))
        elif self._stays >= _LOOKS:
            self._outcome = Outcome(OutcomeKind.NOT_REACHED, f"at rest at {reason}", frame.time)
        elif frame.time - self._looked >= _AGAIN_S:
            self._stays += 1
            self._looked = frame.time
            self._worker.ask(lambda: self._look(frame))

    def _at_most(self, displacement: Displacement) -> tuple[float, float]:
        """Return the largest distance, m, and angle, rad, that the camera may be off, for sure."""
        far_m, far_rad = displacement.at_most()
        return far_m * (1.0 + 3.0 * self._scale_deviation), far_rad

    def _tell(self, time: float, name: str, text: str) -> None:
        self._told.append(Told(time, name, text))
