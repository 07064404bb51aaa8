"""A simulated cell behind the same driver protocol as a real one."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.cell.cell import Cell
from vergence.cell.named_targets import target_key
from vergence.cell.schema import Task
from vergence.loading import asking
from vergence.robot import Arm
from vergence.signals import Frame, JointState, Sample, Setpoint
from vergence.simulation.arm_motion import JointTrajectory, arm_trajectory
from vergence.simulation.motion import PoseByTick, target_poses, target_seed
from vergence.simulation.motions import TargetPose
from vergence.simulation.renderer import choose_renderer


class SimulatedDriver:
    """Renders the cameras and moves the arms of a cell, in lock-step with the loop.

    If `images` is false, frames carry no image, only the ground truth, for exact perception. See
    `SimulatedCameras` for how images are made.

    Targets and cameras are where `as_built` puts them: they differ from the cell's placements by
    the errors that the cell states.
    """

    sim_time = True  # time advances in `step` only

    def __init__(self, cell: Cell, images: bool = True) -> None:
        choose_renderer(needed=images)
        from vergence.simulation.as_built import as_built
        from vergence.simulation.gripper import Gripper
        from vergence.simulation.simulated_cameras import SimulatedCameras
        from vergence.simulation.subject import Subject
        from vergence.simulation.world import World

        self.cell = cell
        built = as_built(cell)
        self.world = World(built)
        self._motions: dict[str, TargetPose] = {
            name: PoseByTick(
                target_poses(built.targets[name], target.motion, target_seed(cell.seed, number)),
                cell.inner_rate_hz,
            )
            for number, (name, target) in enumerate(cell.targets.items())
        }
        self._grippers = {n: Gripper(self.world, n, t) for n, t in cell.outputs.items()}
        self._let_go: dict[str, FloatArray] = {}  # (4, 4) where targets were released last, by name
        self._tick = 0
        self._trajectories = {n: self._own_motion(n) for n, t in cell.arms.items() if t.motion}
        for name, target in cell.targets.items():
            with asking(target.motion, str(cell.path), f"{target_key(name)}.motion"):
                self._motions[name](0.0)
        self._move_targets()
        self.world.update()
        self._subject = Subject(cell, self.world)
        self._subject.take_up(cell.task, images)
        self._cameras = SimulatedCameras(cell, self.world, self._subject, images)
        self._cameras.restart()

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
        return self._subject.features

    def look_for(self, features: FloatArray) -> None:
        """Set the points (M, 3), in the target's frame, whose ground truth frames carry.

        Before the first `step`, frames already delivered by `read` are delivered again. Later,
        images that have not arrived are dropped, since they refer to other points.
        """
        self._subject.features = np.array(features, dtype=np.float64)
        self._told_anew()

    def take_up(self, task: Task, frames: Mapping[str, Frame]) -> dict[str, Frame]:
        """Provide the ground truth for another task of the cell from now on.

        Args:
            task: the next one.
            frames: taken at rest before it, by camera.

        Returns:
            The frames; without images, updated to the next task's features.
        """
        self._subject.take_up(task, self._cameras.render)
        self._told_anew()
        if self._cameras.render:
            return dict(frames)
        return {name: replace(self.first_frame(name), time=f.time) for name, f in frames.items()}

    def restart_cameras(self) -> None:
        """Start again from the present view of the cameras; call before the first `step`."""
        self._cameras.restart()

    def first_frame(self, camera: str) -> Frame:
        """Return the view of a camera at the start, without its latency."""
        return self._cameras.frame(camera, self._tick)

    def frame_at(self, camera: str, arm: str, position: FloatArray) -> Frame:
        """Return the view that a camera would have if an arm's joints were at a position, (n,).

        It replaces an image taken beforehand by moving the arm there.
        """
        now = self.world.joint_position(arm)
        self.world.place_arm(arm, position)
        frame = self.first_frame(camera)
        self.world.place_arm(arm, now)
        return frame

    def anchor(self, camera: str, points_px: FloatArray) -> FloatArray:
        """Make image points (M, 2) the target's features, and return them in its frame, (M, 3), m.

        They are taken from the camera's present pose, so frames then carry the ground truth of
        features that were picked in the image. A ray that misses the target gives NaN.
        """
        points = self.world.anchor(camera, points_px)
        self.look_for(points)
        return points

    def read(self) -> Sample:
        """Return the joints now and the images that have arrived since the last call."""
        joints = {
            name: JointState(
                self.time, self.world.joint_position(name), self.world.joint_velocity(name)
            )
            for name in self.arms
        }
        return Sample(self.time, joints, self._cameras.arrived(self._tick))

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Advance the world by one inner period.

        Arms with a motion of their own follow it, whatever their set-points.
        """
        for name, setpoint in setpoints.items():
            if name not in self._trajectories:
                self.world.command(name, setpoint.position, setpoint.velocity)
        for name, trajectory in self._trajectories.items():
            self.world.command(name, *trajectory.at(self._tick))
        self._tick += 1
        self._move_targets()
        self.world.step()
        self._cameras.expose(self._tick, self._update)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(self._grippers)

    def set_output(self, name: str, value: float) -> None:
        """Close a gripper if the value is at least 0.5, else open it; see `Gripper`."""
        self.world.update()
        gripper = self._grippers[name]
        target, held = gripper.holds, gripper.target_pose()
        gripper.set(value)
        if target is not None and held is not None and not gripper.holds:
            self._let_go[target] = held

    def close(self) -> None:
        """Free the graphics contexts."""
        self._cameras.close()

    def _told_anew(self) -> None:
        if self._tick:
            self._cameras.clear()
        else:
            self._cameras.tell_again()

    def _move_targets(self) -> None:
        """Set every target to its present pose."""
        for name in self._motions:
            self.world.move_target(self._target_pose(name), name)

    def _target_pose(self, name: str) -> FloatArray:
        """Return T_world_target (4, 4): carried by an arm, as released, or by its motion."""
        for gripper in self._grippers.values():
            if gripper.holds == name and (held := gripper.target_pose()) is not None:
                return held
        return self._let_go[name] if name in self._let_go else self._motions[name](self.time)

    def _update(self) -> None:
        """Update everything that cameras see, including targets held by a gripper."""
        self.world.update()
        if any(gripper.holds for gripper in self._grippers.values()):
            self._move_targets()
            self.world.update()

    def _own_motion(self, name: str) -> JointTrajectory:
        held = [n for n, target in self.cell.targets.items() if target.carried_by == name]
        arm = self.world.arm_to_target(held[0]) if held else self.world.arm_to_body(name)
        return arm_trajectory(self.cell, name, arm, self.world.joint_position(name))
