"""The cell in simulation, behind the same border as a real one."""

from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.camera import Camera, image_tick
from vergence.cell.cell import Cell
from vergence.cell.schema import FollowTable, ImagingTable, Task, TrackTable
from vergence.errors import InputError
from vergence.features import inverse_depth_plane
from vergence.geometry import se3_inverse, transform_points
from vergence.robot import Arm
from vergence.runtime.task_ends import looks_for_target
from vergence.signals import Frame, FrameTruth, JointState, Sample, Setpoint
from vergence.simulation.arm_motion import JointTrajectory, arm_trajectory
from vergence.simulation.motion import target_pose
from vergence.simulation.renderer import CameraRenderer, choose_renderer
from vergence.simulation.row_weights import row_weights
from vergence.vision import CurveTracking


class _Exposing(NamedTuple):
    """An image whose shutter is still open for some rows."""

    middle: int  # tick
    complete: int  # tick
    arrival: int  # tick, at the earliest
    frame: Frame  # without its image


class SimulatedDriver:
    """Renders the cameras and moves the arms of a cell, in lock-step with the loop.

    Images are exposed at the camera's rate and arrive its latency later. The cameras have been
    running before the simulation begins: the first `read` delivers what they exposed one latency
    before, at a time below zero. With `images` off frames carry no image, only the truth, for
    perception that is exact by construction.

    Where a camera's `imaging` gives its shutter a duration, its time of exposure is the middle of
    it, and the image arrives no sooner than the shutter has closed.

    Target and cameras are where `as_built` has them: off the cell's placements by the errors that
    the cell states.
    """

    sim_time = True  # it passes in `step` only

    def __init__(self, cell: Cell, images: bool = True) -> None:
        choose_renderer(needed=images)
        from vergence.simulation.as_built import as_built
        from vergence.simulation.gripper import Gripper
        from vergence.simulation.shutter import Shutter
        from vergence.simulation.world import World

        self.cell = cell
        built = as_built(cell)
        self.world = World(built)
        self._pose = target_pose(built.target, cell.target.motion, cell.seed)
        self._grippers = {n: Gripper(self.world, n, t) for n, t in cell.outputs.items()}
        self._let_go: FloatArray | None = None  # (4, 4) where a target was let go last
        self._tick = 0
        self._exposed = dict.fromkeys(cell.cameras, 0)
        self._queue: deque[tuple[int, Frame]] = deque()  # tick of arrival, frame
        self._before_motion: list[tuple[int, Frame]] = []  # all that was exposed until the start
        self._renderers = {}
        if images:
            self._renderers = {
                name: CameraRenderer(
                    self.world.model,
                    name,
                    self.world.cameras[name],
                    table,
                    np.random.default_rng([cell.seed, 2, number]),
                )
                for number, (name, table) in enumerate(cell.cameras.items())
                if name in cell.watched
            }
        self._imaging = {n: table.imaging or ImagingTable() for n, table in cell.cameras.items()}
        self._drops = {
            name: np.random.default_rng([cell.seed, 7, number])
            for number, name in enumerate(cell.cameras)
        }
        self._exposing: list[_Exposing] = []
        longest_s = max((self._imaging[name].open_s for name in self._renderers), default=0.0)
        self._shutter = Shutter(self.world, longest_s, cell.inner_rate_hz) if longest_s else None
        self._trajectories = {n: self._own_motion(n) for n, t in cell.arms.items() if t.motion}
        self.world.move_target(self._pose(0.0))
        self.world.update()
        self._curve = _curve_of(cell.task)
        self._features = self._features_of(cell.task, images)
        self.restart_cameras()

    @property
    def arms(self) -> Mapping[str, Arm]:
        """The arms by name."""
        return self.world.arms

    @property
    def cameras(self) -> Mapping[str, Camera]:
        """The cameras by name."""
        return self.world.cameras

    @property
    def inner_rate_hz(self) -> float:
        """The rate of the physics and of the servos."""
        return self.cell.inner_rate_hz

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._tick / self.cell.inner_rate_hz

    @property
    def features(self) -> FloatArray:
        """The features in the target's frame, (M, 3), m."""
        return self._features

    def look_for(self, features: FloatArray) -> None:
        """Make points (M, 3) in the target's frame those of which frames tell the truth.

        Before the first `step`, what `read` has delivered it delivers again. Later, images under
        way are dropped: they tell of other points.
        """
        self._features = np.array(features, dtype=np.float64)
        if self._tick:
            self._queue.clear()
            self._exposing.clear()
            return
        self._queue = deque(
            (
                arrival,
                replace(
                    frame, truth=self._truth(frame.camera, self._is_blind(frame.camera, self.time))
                ),
            )
            for arrival, frame in self._before_motion
        )
        self._before_motion = list(self._queue)

    def take_up(self, task: Task, frames: Mapping[str, Frame]) -> dict[str, Frame]:
        """Tell the truth from now on of what another task of the cell looks at.

        Args:
            task: the next one.
            frames: taken at rest before it, by camera.

        Returns:
            The frames, which without images show what the next task looks at.
        """
        self._curve = _curve_of(task)
        self.look_for(self._features_of(task, images=bool(self._renderers)))
        if self._renderers:
            return dict(frames)
        return {name: replace(self._frame(name), time=f.time) for name, f in frames.items()}

    def restart_cameras(self) -> None:
        """Begin again with what the cameras see now; to be called before the first `step`."""
        self._queue.clear()
        self._exposing.clear()
        if self._shutter is not None:
            self._shutter.begin(self._tick)
        self._exposed = dict.fromkeys(self._exposed, 0)
        for name, table in self.cell.cameras.items():
            if table.latency_frames:
                frame = replace(self._frame(name), time=-table.latency_frames / table.rate_hz)
                self._queue.append((0, frame))
        self._expose()
        self._before_motion = list(self._queue)

    def first_frame(self, camera: str) -> Frame:
        """Return what a camera sees at the start, without its latency."""
        return self._frame(camera)

    def frame_at(self, camera: str, arm: str, position: FloatArray) -> Frame:
        """Return what a camera would see if an arm's joints stood at a position, (n,).

        It stands for an image taken beforehand, by driving there.
        """
        now = self.world.joint_position(arm)
        self.world.place_arm(arm, position)
        frame = self._frame(camera)
        self.world.place_arm(arm, now)
        return frame

    def anchor(self, camera: str, points_px: FloatArray) -> FloatArray:
        """Make image points (M, 2) the target's features, and return those, (M, 3).

        They are seen from where the camera is now. So frames tell the truth of features that were
        picked in the image. A ray that misses the target gives NaN.
        """
        points = self.world.anchor(camera, points_px)
        self.look_for(points)
        return points

    def read(self) -> Sample:
        """Return joints now and the images that have arrived since the last call."""
        arrived = []
        waiting: deque[tuple[int, Frame]] = deque()
        for arrival, frame in self._queue:
            if arrival <= self._tick:
                arrived.append(frame)
            else:
                waiting.append((arrival, frame))
        self._queue = waiting
        joints = {
            name: JointState(
                self.time, self.world.joint_position(name), self.world.joint_velocity(name)
            )
            for name in self.arms
        }
        return Sample(self.time, joints, tuple(sorted(arrived, key=lambda frame: frame.time)))

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Advance the world by one inner period.

        Arms with a motion of their own follow that, whatever their set-points.
        """
        for name, setpoint in setpoints.items():
            if name not in self._trajectories:
                self.world.command(name, setpoint.position, setpoint.velocity)
        for name, trajectory in self._trajectories.items():
            self.world.command(name, *trajectory.at(self._tick))
        self._tick += 1
        self.world.move_target(self._target_pose())
        self.world.step()
        if self._shutter is not None:
            self.world.update()
            self._carry_target()
            self._shutter.remember(self._tick)
        self._expose()
        self._complete()

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(self._grippers)

    def set_output(self, name: str, value: float) -> None:
        """Close a gripper, from a value of a half on, or open it; see `Gripper`."""
        self.world.update()
        gripper = self._grippers[name]
        held = gripper.target_pose()
        gripper.set(value)
        if held is not None and not gripper.holds:
            self._let_go = held

    def close(self) -> None:
        """Free the graphics contexts."""
        for renderer in self._renderers.values():
            renderer.close()

    def _target_pose(self) -> FloatArray:
        """Return T_world_target (4, 4): with the arm, where it was let go, or as it moves."""
        poses = (gripper.target_pose() for gripper in self._grippers.values())
        held = next((T for T in poses if T is not None), self._let_go)
        return self._pose(self.time) if held is None else held

    def _carry_target(self) -> None:
        """Put a target that is held where the arm is now, rather than one tick ago."""
        if any(gripper.holds for gripper in self._grippers.values()):
            self.world.move_target(self._target_pose())
            self.world.update()

    def _own_motion(self, name: str) -> JointTrajectory:
        carries = self.cell.target.carried_by == name
        arm = self.world.arm_to_target() if carries else self.world.arm_to_body(name)
        return arm_trajectory(self.cell, name, arm, self.world.joint_position(name))

    def _expose(self) -> None:
        fresh = False
        for name, table in self.cell.cameras.items():
            due = self._tick_of(self._exposed[name], table.rate_hz)
            if self._tick < due:
                continue
            if not fresh:
                self.world.update()
                self._carry_target()
                fresh = True
            arrival = self._tick_of(self._exposed[name] + table.latency_frames, table.rate_hz)
            first = not self._exposed[name]
            self._exposed[name] += 1
            if first:  # nothing has moved yet
                self._queue.append((arrival, self._frame(name)))
            elif not self._is_dropped(name):
                self._take(name, arrival)

    def _take(self, name: str, arrival: int) -> None:
        """Take an image now, or begin to."""
        if self._shutter is None or name not in self._renderers or not self._imaging[name].open_s:
            self._queue.append((arrival, self._frame(name, settled=False)))
            return
        complete = self._tick + self._shutter.ticks_after(self._imaging[name])
        frame = self._frame(name, shown=False)
        self._exposing.append(_Exposing(self._tick, complete, arrival, frame))

    def _complete(self) -> None:
        """Render the images whose shutter has closed."""
        for one in [one for one in self._exposing if one.complete <= self._tick]:
            self._exposing.remove(one)
            frame = replace(one.frame, image=self._moving_image(one))
            self._queue.append((max(one.arrival, self._tick), frame))

    def _moving_image(self, one: _Exposing) -> ImageArray:
        name = one.frame.camera
        renderer, imaging, shutter = self._renderers[name], self._imaging[name], self._shutter
        assert shutter is not None
        if self._is_blind(name, one.frame.time):
            return renderer.take(self.world.data, blind=True, settled=False)
        moments = shutter.moments(name, one.middle, imaging)
        seconds = (moments - one.middle) / self.inner_rate_hz
        weights = row_weights(seconds, self.cameras[name].height, imaging)
        return renderer.take_moving(shutter.at, moments, weights)

    def _is_dropped(self, name: str) -> bool:
        return bool(self._drops[name].random() < self._imaging[name].dropped)

    def _tick_of(self, image: int, rate_hz: float) -> int:
        return image_tick(image, self.inner_rate_hz, rate_hz)

    def _frame(self, camera: str, settled: bool = True, shown: bool = True) -> Frame:
        """Return what a camera sees now, its image only if shown; see `Sensor.read`."""
        blind = self._is_blind(camera, self.time)
        renderer = self._renderers.get(camera)
        image = None
        if renderer is not None and shown:
            image = renderer.take(self.world.data, blind, settled)
        joints = {name: self.world.joint_position(name) for name in self.arms}
        sensor, depth = self.cell.cameras[camera].depth, None
        if sensor is not None and renderer is not None:
            depth = renderer.depth(self.world.data, sensor)
        return Frame(camera, self.time, image, joints, self._truth(camera, blind), depth)

    def _is_blind(self, camera: str, time: float) -> bool:
        return any(a <= time < b for a, b in self.cell.cameras[camera].blind_s)

    def _features_of(self, task: Task, images: bool) -> FloatArray:
        """Return the points (M, 3) of the target that a task follows, where they are known.

        Without images nobody picks features: they are spread over the middle of the task's image.
        """
        self._inside_target = False
        known = self.cell.target.features
        if known:
            return np.array(known, dtype=np.float64)
        if isinstance(task, FollowTable) or looks_for_target(task.until):
            from vergence.vision.known_object import as_followed, object_model_of

            model = object_model_of(self.world.model, "target")
            followed = as_followed(model)
            self._inside_target = followed is not model
            return followed.corners
        if images or not isinstance(task, TrackTable):
            return np.empty((0, 3))
        camera = self.cameras[task.camera]
        points_px = grid_points(camera.width, camera.height, task.feature_count)
        return self.world.anchor(task.camera, points_px)

    def _truth(self, camera: str, blind: bool) -> FrameTruth:
        T_world_target, features = self._subject(camera)
        T_world_camera = self.world.camera_pose(camera)
        T_camera_target = se3_inverse(T_world_camera) @ T_world_target
        points = transform_points(T_camera_target, features)
        intrinsics = self.cameras[camera]
        depth = points[:, 2].copy()
        in_front = depth > 1e-3
        points_px = np.full((len(points), 2), np.nan)
        points_px[in_front] = intrinsics.project(points[in_front])
        visible = intrinsics.in_view(points) & in_front & np.bool_(not blind)
        in_sight = np.flatnonzero(visible)
        if len(in_sight):
            points_world = transform_points(T_world_target, features[in_sight])
            visible[in_sight] = self.world.sees(camera, points_world, self._inside_target)
        truth = FrameTruth(T_world_target, T_world_camera, points_px, depth, visible)
        return truth if self._curve is None else _truth_of_curve(truth, self._curve, intrinsics)

    def _subject(self, camera: str) -> tuple[FloatArray, FloatArray]:
        """Return pose (4, 4) and features (M, 3) of what a camera looks at: target or tool."""
        tool = self.cell.tool
        if tool is None or tool.camera != camera:
            return self.world.target_pose(), self._features
        return self.world.tool_pose(), np.array(tool.features)


def _curve_of(task: Task) -> CurveTracking | None:
    """Return what follows a curve in a task, if anything does."""
    tracker = getattr(task, "tracker", None)
    return tracker if isinstance(tracker, CurveTracking) else None


def _truth_of_curve(truth: FrameTruth, curve: CurveTracking, camera: Camera) -> FrameTruth:
    """Return the truth of the points that stand for a curve, from points on it."""
    before: BoolArray = np.isfinite(truth.points_px[:, 0])
    nothing = replace(truth, visible=np.zeros(len(before), dtype=np.bool_))
    if not len(before) or not before.all():
        return nothing
    try:
        points_px = curve.points_on(truth.points_px, (camera.width, camera.height))
    except InputError:  # a circle on edge, a line seen end on
        return nothing
    between = np.linalg.norm(points_px[:, None] - truth.points_px[None], axis=2)
    A, B, C = inverse_depth_plane(camera.normalize(truth.points_px), truth.depth_m)
    x, y = camera.normalize(points_px).T
    depth_m = 1.0 / (A * x + B * y + C)
    nearest = between.argmin(axis=1)
    in_sight = truth.visible | ~camera.contains(truth.points_px)
    visible = in_sight[nearest] & camera.contains(points_px)
    return replace(truth, points_px=points_px, depth_m=depth_m, visible=visible)


def grid_points(width: int, height: int, count: int) -> FloatArray:
    """Return points (count, 2) spread over the middle of an image; one alone in its centre."""
    side = int(np.ceil(np.sqrt(count)))
    share = (np.arange(side) + 0.5) / side
    u, v = np.meshgrid(width * (0.25 + 0.5 * share) - 0.5, height * (0.25 + 0.5 * share) - 0.5)
    return np.column_stack((u.ravel(), v.ravel()))[:count]
