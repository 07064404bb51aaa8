"""A servo on image points as numbers, for the kernel of its tick."""

from typing import NamedTuple

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.control.depth.carried import CarriedPoints
from vergence.control.image_motion import ExposedFeatures, FeatureState
from vergence.control.objectives import PackedSetup
from vergence.control.past_joints import PastJoints
from vergence.control.solvers._program import ProgramSettings, ProgramState
from vergence.control.sum_of_terms import Total
from vergence.control.target_flow import FlowState
from vergence.robot.chain import Chain

FINE, SINGULAR, NONSENSE, UNDETERMINED = range(4)  # how a tick ends
HELD, CARRIED, FROM_FEATURES = range(3)  # kinds of depth
IMAGE, POSE, TRACKING, POSTURE = range(4)  # kinds of objective


class SeenPoints(NamedTuple):
    """An image's features, found or not."""

    time: float  # s, of exposure
    points: FloatArray  # (M, 2) normalized coordinates; NaN where not found
    found: BoolArray  # (M,)


class Moment(NamedTuple):
    """The input of a tick."""

    chain: Chain  # of the arm, up to the camera
    image: SeenPoints  # a new one, in which a feature was found
    q: FloatArray  # (n,) joint positions
    velocity: FloatArray  # (n,) joint rates
    time: float  # s


class AsMeasured(NamedTuple):
    """Features are used as measured, at the depth believed at the start."""

    believed_m: FloatArray  # (M,)


class PredictedMotion(NamedTuple):
    """Features are predicted, or the target's motion fed forward: see `ImageMotion`."""

    believed_m: FloatArray  # (M,)
    depth: int  # HELD, CARRIED or FROM_FEATURES
    features: FloatArray  # (M, 3) in the target's frame, m
    rotations: FloatArray  # from `spread_rotations`
    covariance: FloatArray  # (M, 2, 2) of the points, normalized
    smoothing_s: float  # of the target's flow; infinite if it is not fed forward
    prediction: bool


class TermNumbers(NamedTuple):
    """The objectives of a sum, a row each; zero is what an objective does not have."""

    weight: FloatArray  # (T,)
    kind: IntArray  # (T,) IMAGE, POSE, TRACKING or POSTURE
    gain: FloatArray  # (T, 3) fields of `GainNumbers`
    feature: IntArray  # (T,) of `COMPILED_FEATURES`
    interaction: IntArray  # (T,) see `PointDecay`
    damping: FloatArray  # (T,)
    controlled: FloatArray  # (T, 6) 1 for a camera axis that it controls, else 0
    Q: FloatArray  # (T,) of `TrackingGains`
    R: FloatArray  # (T, 6)
    position: FloatArray  # (T, n) see `PostureDecay`
    strength: FloatArray  # (T,)


class PointGoal(NamedTuple):
    """What the objectives are about."""

    terms: TermNumbers
    desired: FloatArray  # (M, 2) normalized coordinates
    depth_m: FloatArray  # (M,) at the goal; NaN if unknown
    variance: float  # of a point's row
    focal_px: FloatArray  # (2,)
    period_s: float  # between two images


class InverseSolver(NamedTuple):
    """The solver `PseudoInverse` or `DampedPseudoInverse`."""

    rate_max: FloatArray  # (n,)
    singular_below: float
    damped: bool


class ProgramSolver(NamedTuple):
    """The solver `QuadraticProgram`, without limits that are not made in kernels."""

    settings: ProgramSettings
    solids: FloatArray  # (K, 16) that may occlude features
    surface_known: bool  # whether the faces around the features are
    features: FloatArray  # (M, 3) in the target's frame, m
    goal: FloatArray  # (M, 3) in the camera frame at the goal, m; (0, 3) if unknown
    planes: FloatArray  # (F, 6) of `FeatureFaces`
    holds: BoolArray  # (M, F) of `FeatureFaces`


class PointLaw(NamedTuple):
    """A law by objectives and a solver."""

    chain: Chain  # up to the camera
    motion: PredictedMotion
    goal: PointGoal
    solver: InverseSolver | ProgramSolver


class TrackingLaw(NamedTuple):
    """Optimal tracking by the inverse of the Jacobian, see `TrackingTickLaw`."""

    chain: Chain
    motion: AsMeasured | PredictedMotion
    setup: PackedSetup
    desired: FloatArray  # (M, 2) normalized coordinates
    singular_below: float
    feeds_forward: bool


class NoMemory(NamedTuple):
    """The memory of features that are used as measured."""


class MotionMemory(NamedTuple):
    """What `PredictedMotion` remembers from image to image."""

    joints: PastJoints
    exposed: ExposedFeatures  # at a time of minus infinity before the first image
    flow: FlowState
    carried: CarriedPoints
    pose: FloatArray  # (4, 4) T_scene_target fitted last, or `NO_POSE`


class LawMemory(NamedTuple):
    """What a law remembers from tick to tick."""

    motion: NoMemory | MotionMemory
    program: ProgramState


class Wish(NamedTuple):
    """What the objectives want of a solver."""

    now: Moment
    features: FeatureState  # those found
    total: Total


class LawTick(NamedTuple):
    """The result of a tick."""

    rates: FloatArray  # (n,) rad/s or m/s
    end: int  # FINE, or why the law cannot continue
    value: float  # if SINGULAR, the smallest singular value of J; if UNDETERMINED, how many points
