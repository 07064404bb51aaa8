"""The interface of a solver: joint rates for a quadratic in the twist of the arm's tip."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.limits import KIND_NAMES, Limits
from vergence.control.mounting import CameraMounting
from vergence.robot import Arm, Clearance
from vergence.signals import OutcomeKind

Obstacles: TypeAlias = Callable[[], FloatArray]  # what may occlude the features now, (K, 16)

NO_FEATURES = np.empty((0, 7))  # from `pack_features`
NO_FACES = np.empty((0, 6))
NO_JOINTS = np.empty((0, 0)), np.empty(0)  # no quadratic in the joint rates
AT_TIP = np.empty((0, 0))  # the twist map of a camera at the tip


class Problem(NamedTuple):
    """The input of one tick."""

    q: FloatArray  # (n,) joint positions
    velocity: FloatArray  # (n,) joint rates now
    H: FloatArray  # (6, 6) of ½ vᵀ H v - gᵀ v over the twist of the arm's tip
    g: FloatArray  # (6,)
    features: FloatArray  # (M, 7) features that must stay in view, from `pack_features`
    null_space_rates: FloatArray  # (n,) desired where the objectives leave freedom
    H_joints: FloatArray  # (n, n) of a quadratic in the joint rates; (0, 0) for none
    g_joints: FloatArray  # (n,); (0,) for none
    A: FloatArray  # (6, 6) with v_camera = A v_tip; (0, 0) for a camera at the tip
    null_space_weight: float = 0.0  # lower bound on μ of ‖q̇ - q̇_null‖²
    depth_share: float = float("nan")  # largest relative deviation of a depth; NaN if unknown
    variance: float = 0.0  # variance of the rows of which H and g are made, caused by noise
    # Faces that show the features, their centres and outward normals in the camera frame, (F, 6).
    faces: FloatArray = NO_FACES
    surface_known: bool = False  # if not, coplanar features are assumed to have a face


class Solution(NamedTuple):
    """The result of one tick."""

    rates: FloatArray  # (n,) rad/s or m/s
    v_tip: FloatArray  # (6,) resulting twist of the arm's tip, m/s and rad/s
    manipulability: float  # w'
    penalty: float  # P
    active: FloatArray  # (K,) by kind of limit: number of active rows
    slack: FloatArray  # (K,) by kind: the largest slack, in the row's own unit
    solved: bool
    fault: tuple[OutcomeKind, str] | None = None  # why the servo cannot continue
    clearance: Mapping[str, float] = MappingProxyType({})  # m, smallest distance by kind of body


@dataclass(frozen=True, slots=True)
class Setting:
    """The input from which a solver is made.

    Attributes:
        arm: up to its tip.
        mounting: of the camera whose features must stay in view.
        limits: to enforce; None for a solver without limits.
        period_s: time for which a command acts.
        obstacles: returns what may occlude features; None for nothing.
        depth_range: bounds on true over believed depth, where the limits give none.
        start: joint positions at the start, (n,); those of the first tick if None.
        clearance: computes distances between bodies that must not collide; None for no check.
    """

    arm: Arm
    mounting: CameraMounting
    limits: Limits | None
    period_s: float
    obstacles: Obstacles | None = None
    depth_range: tuple[float, float] = (0.5, 2.0)
    start: FloatArray | None = None
    clearance: Clearance | None = None


class BoundSolver(Protocol):
    """A solver for one arm."""

    names: tuple[str, ...]  # of the kinds of limits
    keeps_limits: bool
    view: tuple[FloatArray, FloatArray]  # lower and upper bounds, normalized, (2,) each

    def solve(self, problem: Problem) -> Solution:
        """Return the joint rates for one tick."""
        ...


@runtime_checkable
class Solver(Protocol):
    """Computes joint rates from objectives."""

    def bind(self, setting: Setting) -> BoundSolver:
        """Return the solver for one arm.

        Raises:
            InputError: if the settings contradict each other or do not suit the arm.
        """
        ...


UNBOUNDED = (np.full(2, -np.inf), np.full(2, np.inf))


class Pressure(NamedTuple):
    """The limits that affected a command, in the form of `JointCommand`."""

    active: tuple[str, ...]  # active limits
    slack: dict[str, float]  # relaxed limits: by how much, in the unit of their rows


def describe(
    active: FloatArray, slack: FloatArray, solved: bool, names: tuple[str, ...] = KIND_NAMES
) -> Pressure:
    """Return the names of active and relaxed limits, by kind."""
    if not solved:
        return Pressure(("no solution: braking",), {})
    pushed = tuple(name for name, count in zip(names, active, strict=True) if count)
    relaxed = {name: float(amount) for name, amount in zip(names, slack, strict=True) if amount > 0}
    return Pressure(pushed, relaxed)
