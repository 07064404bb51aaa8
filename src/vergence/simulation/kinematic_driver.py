"""A cell without physics and without images: for thousands of runs."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.camera import Camera, image_tick
from vergence.geometry import se3_compose, se3_inverse, transform_points
from vergence.robot import Arm
from vergence.signals import Frame, FrameTruth, JointState, Sample, Setpoint
from vergence.simulation.motions import TargetPoses

ARM, CAMERA = "arm", "camera"
IN_FRONT_M = 1e-3  # depth from which a feature can be seen
_POSES = 64  # of the target, computed at once

# From joint positions (n,) and T_world_target (4, 4) to the features that are not occluded, (M,).
Sees = Callable[[FloatArray, FloatArray], BoolArray]


@dataclass(frozen=True, slots=True)
class KinematicCell:
    """One arm that carries one camera, and a target in free space."""

    arm: Arm  # up to the camera
    camera: Camera
    start: FloatArray  # (n,) joint positions
    target: TargetPoses  # its poses at given times
    features: FloatArray  # (M, 3) in the target's frame, m
    rate_hz: float = 30.0  # of the camera
    inner_rate_hz: float = 120.0  # rate of the set-points
    latency_frames: int = 0
    dropped: float = 0.0  # fraction of the images that never arrive
    seed: int = 0  # for the choice of dropped images
    sees: Sees | None = None  # which features are not occluded; all if None


@njit(cache=True, error_model="numpy")
def in_camera(
    T_world_camera: FloatArray, T_world_target: FloatArray, features: FloatArray
) -> FloatArray:
    """Return the features (M, 3) of a target in the camera frame, (M, 3), m."""
    points: FloatArray = transform_points(
        se3_compose(se3_inverse(T_world_camera), T_world_target), features
    )
    return points


class KinematicDriver:
    """Moves the joints exactly as commanded and projects the features exactly.

    It is a driver like any other, so the loop, the guard and the laws are the same as on a real
    arm.
    """

    sim_time = True  # time advances in `step` only

    def __init__(self, cell: KinematicCell) -> None:
        self._cell = cell
        self._rng = np.random.default_rng(cell.seed)
        self._tick = self._exposed = 0
        self._position, self._velocity = np.array(cell.start), np.zeros(len(cell.start))
        self._queue: deque[tuple[int, Frame]] = deque()
        self._poses = np.empty((0, 4, 4))  # of the target, for a run of images
        self._expose()

    @property
    def arms(self) -> Mapping[str, Arm]:
        """The arm."""
        return {ARM: self._cell.arm}

    @property
    def cameras(self) -> Mapping[str, Camera]:
        """The camera."""
        return {CAMERA: self._cell.camera}

    @property
    def inner_rate_hz(self) -> float:
        """How often `step` is to be called."""
        return self._cell.inner_rate_hz

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._tick / self.inner_rate_hz

    def read(self) -> Sample:
        """Return the joints now and the images that have arrived since the last call."""
        frames = []
        while self._queue and self._queue[0][0] <= self._tick:
            frames.append(self._queue.popleft()[1])
        joints = JointState(self.time, self._position, self._velocity)
        return Sample(self.time, {ARM: joints}, tuple(frames))

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Move the joints to the set-points."""
        self.advance(setpoints, 1)

    @property
    def quiet_ticks(self) -> int:
        """Return the number of inner ticks until the next image is exposed or arrives."""
        events = [self._tick_of(self._exposed), *(tick for tick, _ in self._queue)]
        return min(events) - self._tick

    def advance(self, setpoints: Mapping[str, Setpoint], ticks: int) -> None:
        """Move the joints to where they are after this many ticks."""
        self._position = setpoints[ARM].position
        self._velocity = setpoints[ARM].velocity
        self._tick += ticks
        if self._tick >= self._tick_of(self._exposed):
            self._expose()

    def close(self) -> None:
        """Do nothing; there is no resource to release."""

    def frame(self) -> Frame:
        """Return what the camera sees now."""
        return self._frame(self._cell.target(np.array([self.time]))[0])

    def _frame(self, T_world_target: FloatArray) -> Frame:
        return Frame(CAMERA, self.time, None, {ARM: self._position}, self._truth(T_world_target))

    def _expose(self) -> None:
        arrival = self._tick_of(self._exposed + self._cell.latency_frames)
        T_world_target = self._pose_at(self._exposed)
        self._exposed += 1
        if self._rng.random() >= self._cell.dropped:
            self._queue.append((arrival, self._frame(T_world_target)))

    def _pose_at(self, image: int) -> FloatArray:
        """Return the target's pose (4, 4) at an image; poses are computed for a run of images."""
        at = image % _POSES
        if at == 0:
            ticks = [self._tick_of(image + k) for k in range(_POSES)]
            self._poses = self._cell.target(np.array(ticks) / self.inner_rate_hz)
        pose: FloatArray = self._poses[at]
        return pose

    def _tick_of(self, image: int) -> int:
        return image_tick(image, self._cell.inner_rate_hz, self._cell.rate_hz)

    def _truth(self, T_world_target: FloatArray) -> FrameTruth:
        cell = self._cell
        T_world_camera = cell.arm.forward_kinematics(self._position)
        points = in_camera(T_world_camera, T_world_target, cell.features)
        depth = points[:, 2].copy()
        in_front = depth > IN_FRONT_M
        points_px = np.full((len(points), 2), np.nan)
        points_px[in_front] = cell.camera.project(points[in_front])
        # Far outside the image, only a distorted lens model could fold points back into it.
        distorted = cell.camera.distorted
        seen = cell.camera.in_view(points) if distorted else cell.camera.contains(points_px)
        visible = in_front & seen
        if cell.sees is not None and visible.any():
            visible &= cell.sees(self._position, T_world_target)
        return FrameTruth(T_world_target, T_world_camera, points_px, depth, visible)
