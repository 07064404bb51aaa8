"""Servoing by every kind of feature: a free camera by the law alone, an arm under limits."""

from typing import NamedTuple, Protocol

import numpy as np

from vergence.arrays import FloatArray
from vergence.control import (
    ImageBased,
    Limits,
    MotionSettings,
    Objective,
    PointPose,
    QuadraticProgram,
    Servo,
    Situation,
)
from vergence.control.objectives import state_of
from vergence.errors import InputError
from vergence.features import Centre, Feature, LogDepth, Points, RegionMoments
from vergence.features import Ellipse as EllipseFeature
from vergence.features import Lines as LinesFeature
from vergence.geometry import se3_exp, se3_inverse
from vergence.studies.features.scene import (
    ARRIVED_PX,
    CAMERA,
    GAIN,
    PERIOD_S,
    STEPS,
    Start,
    arm,
    compared,
    seen,
)
from vergence.studies.ideal_loop import Ending

_ROUNDING = 1e-9  # of a limit


class Servoing(NamedTuple):
    """What became of one servoing."""

    ending: Ending
    time_s: float
    path_m: float  # of the camera
    too_fast: bool = False  # whether a joint ever passed its rate limit


class _Plant(Protocol):
    """What carries the camera."""

    T_camera_target: FloatArray
    too_fast: bool

    def outside(self) -> bool:
        """Whether a joint is beyond a limit."""
        ...

    def move(self, now: Points, goal: Points) -> None:
        """Go on by one period as the law has it."""
        ...


def objectives(kind: str) -> list[Objective]:
    """Return what a servo by a kind of feature is the sum of."""
    if kind == "2.5d":  # [Malis1999]
        return [
            ImageBased(gain=GAIN, feature=Centre),
            ImageBased(gain=GAIN, feature=LogDepth),
            PointPose(gain=GAIN, axes=("rx", "ry", "rz")),
        ]
    features: dict[str, type[Feature]] = {
        "points": Points,
        "lines": LinesFeature,
        "ellipse": EllipseFeature,
        "moments": RegionMoments,
    }
    return [ImageBased(gain=GAIN, feature=features[kind], damping=_damping(kind))]


def _damping(kind: str) -> float:
    """Return the default, less for an ellipse: tilts change its second moments so little."""
    return 1e-9 if kind == "ellipse" else 1e-6


class _FreeCamera:
    """A camera that moves as the law asks."""

    too_fast = False

    def __init__(self, kind: str, start: Start) -> None:
        self.T_camera_target = start.T_camera_target.copy()
        self._objectives = objectives(kind)

    def outside(self) -> bool:
        return False

    def move(self, now: Points, goal: Points) -> None:
        state = state_of(now, goal)
        quadratics = [objective.quadratic(state) for objective in self._objectives]
        H, g = sum(part.H for part in quadratics), sum(part.g for part in quadratics)
        v_camera: FloatArray = np.linalg.lstsq(H, g, rcond=None)[0].astype(np.float64)
        self.T_camera_target = se3_exp(-PERIOD_S * v_camera) @ self.T_camera_target


class _ArmCamera:
    """A camera on an arm, by the servo under its limits."""

    def __init__(self, kind: str, start: Start) -> None:
        self._arm, self._q, self._rates = arm(), start.q, np.zeros(len(start.q))
        self.T_camera_target = start.T_camera_target.copy()
        self._T_world_target = self._arm.forward_kinematics(start.q) @ start.T_camera_target
        self.too_fast = False
        still = MotionSettings(feed_forward=False, prediction=False)
        self._servo = Servo(
            self._arm,
            CAMERA,
            objectives(kind),
            limits=Limits(),
            solver=QuadraticProgram(damping=_damping(kind)),
            depth_m=1.0,
            situation=Situation(PERIOD_S, still, depth_range=(0.9, 1.1), start=start.q),
        )

    def outside(self) -> bool:
        q, arm = self._q, self._arm
        return bool(((q < arm.q_min - _ROUNDING) | (q > arm.q_max + _ROUNDING)).any())

    def move(self, now: Points, goal: Points) -> None:
        self._rates = self._servo.rates(now, goal, self._q, self._rates)
        over = np.abs(self._rates) > self._arm.rate_max * (1.0 + _ROUNDING)
        self.too_fast |= bool(over.any())
        self._q = self._q + PERIOD_S * self._rates
        T_camera_world = se3_inverse(self._arm.forward_kinematics(self._q))
        self.T_camera_target = T_camera_world @ self._T_world_target


def servo(kind: str, start: Start, on_arm: bool) -> Servoing:
    """Servo from a start by a kind of feature until it arrives, fails, or time is up."""
    plant: _Plant = _ArmCamera(kind, start) if on_arm else _FreeCamera(kind, start)
    goal = seen(kind, start.T_goal_target)
    assert goal is not None
    desired = CAMERA.to_pixels(compared(kind, goal.points))
    path, ending = 0.0, Ending.SHORT
    for k in range(STEPS + 1):
        now = seen(kind, plant.T_camera_target)
        px = None if now is None else CAMERA.to_pixels(compared(kind, now.points))
        if px is None or not CAMERA.contains(px).all():
            ending = Ending.VIEW
        elif plant.outside():
            ending = Ending.JOINT
        elif np.linalg.norm(px - desired, axis=1).max() < ARRIVED_PX:
            ending = Ending.ARRIVED
        if ending is not Ending.SHORT or k == STEPS:
            break
        assert now is not None
        before = se3_inverse(plant.T_camera_target)[:3, 3]
        try:
            plant.move(now, goal)
        except InputError:  # the points make no such feature, such as a line end on
            break
        after = se3_inverse(plant.T_camera_target)[:3, 3]
        path += float(np.linalg.norm(after - before))
    return Servoing(ending, k * PERIOD_S, path, plant.too_fast)
