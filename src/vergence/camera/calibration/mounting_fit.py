"""Lens, mounting and board together, from pictures and the arm's poses at their exposures."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.failure import CalibrationFailure
from vergence.camera.calibration.hand_eye import TOLERATED, Agreement, agree, turning_deg
from vergence.camera.calibration.hints import hint
from vergence.camera.calibration.joint_fit import JointProblem, Noise, State
from vergence.camera.calibration.lens_fit import board_pose
from vergence.camera.calibration.normal_equations import (
    covariance,
    jackknife,
    steps_without,
)
from vergence.camera.calibration.reprojection import lens_of, residuals, rms
from vergence.camera.calibration.sighting import BadPicture, Sighting, pixels
from vergence.camera.pinhole import Camera
from vergence.geometry import se3_inverse

FEWEST_POSES = 5
_LEAST_TURN_DEG = 3.0
_SUSPICIOUS = 4.0  # times the median residual
_SMALLEST_PX = 0.5  # residuals below are never held against a picture
_DOUBTFUL_M, _DOUBTFUL_RAD = 1e-3, np.deg2rad(0.2)  # disagreement for which a reason is sought
_ROUNDS = 6


@dataclass(frozen=True, slots=True)
class MountingFit:
    """How a camera is mounted, and where the board was, as pictures and arm poses have it.

    The deviations assume errors of the corners as in the fit of the lens, and errors of the arm's
    poses that are independent from picture to picture; the size of both is estimated.
    """

    fixed: bool  # the arm carried the board, not the camera
    camera: Camera
    T_mount_camera: FloatArray  # (4, 4) in the flange, or in the arm's base where fixed
    T_mount_board: FloatArray  # (4, 4) in the arm's base, or in the flange where fixed
    covariance: FloatArray  # (21, 21) lens; camera and board: position, m, and rotation, rad
    jackknife: FloatArray  # (21,) standard deviations from leaving out each picture in turn
    noise: Noise
    sightings: tuple[Sighting, ...]  # those kept
    residuals: tuple[FloatArray, ...]  # (2n,) each, px
    left_out_px: FloatArray  # (N,) rms of each picture as all others predict it
    left_out_m: (
        FloatArray  # (N,) how far they predict the middle of the board from where it is seen
    )
    left_out_rad: FloatArray  # (N,) and by what angle
    turning_deg: FloatArray  # (3,) how far the arm turned about three axes, largest first
    bad: tuple[BadPicture, ...]
    hint: str  # which mistake would explain that pictures and poses disagree much; often empty

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations (21,), 0 for what was not estimated; rotations about mount's axes."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def rms_px(self) -> float:
        """Root mean square distance of all corners."""
        return rms(np.concatenate(self.residuals))


def fit_mounting(
    sightings: Sequence[Sequence[Sighting]],
    T_base_flange: FloatArray,
    camera: Camera,
    noise_px: float,
    *,
    fixed: bool = False,
    free: FloatArray | None = None,
    rng: np.random.Generator,
) -> MountingFit | CalibrationFailure:
    """Estimate lens, mounting and board together, leaving out pictures that contradict the others.

    Args:
        sightings: of each picture, one for each orientation that the board may have had in it.
        T_base_flange: the arm's pose at each, (N, 4, 4).
        camera: as the pictures alone give it, or as it is known.
        noise_px: standard deviation of a corner's coordinate, as the pictures alone give it.
        fixed: the camera is fixed and the arm carries the board; else the arm carries the camera.
        free: which parameters of the lens are estimated, (9,); none by default.
        rng: chooses the pictures that a start is made of.

    Returns:
        the fit, or in words why these pictures and poses cannot tell.
    """
    A = np.ascontiguousarray(T_base_flange if fixed else [se3_inverse(T) for T in T_base_flange])
    reason = _poses_too_few_or_alike(A, "")
    if reason:
        return CalibrationFailure(reason)
    lens = lens_of(camera)
    seen = np.array([[board_pose(camera, s) for s in each] for each in sightings])
    start = agree(sightings, A, seen, lens, camera.width, rng)
    state = State(lens, start.mounting)
    free = np.zeros(9) if free is None else free
    kept = np.flatnonzero(start.residual_px < _limit(start.residual_px, camera.width))
    for _ in range(_ROUNDS):
        if 2 * len(kept) <= len(A) or len(kept) < FEWEST_POSES:
            words = hint(sightings, A, seen, lens, camera.width, fixed, rng)
            return CalibrationFailure(_contradiction(start, len(kept), words))
        chosen = [sightings[n][int(start.turns[n])] for n in kept.tolist()]
        problem = JointProblem(tuple(chosen), A[kept], camera, free, fixed)
        state = problem.solved(state, Noise(noise_px))
        sizes = _sizes(state, sightings, start, A)
        again = np.flatnonzero(sizes <= _limit(sizes[kept], camera.width))
        if np.array_equal(again, kept):
            break
        kept = again
    reason = _poses_too_few_or_alike(A[kept], " without the pictures that contradict the others")
    if reason:
        return CalibrationFailure(reason)
    noise = Noise(noise_px)
    for _ in range(3):
        noise = problem.noise(state, noise_px)
        state = problem.solved(state, noise)
    sizes = _sizes(state, sightings, start, A)
    bad = [
        BadPicture(
            sightings[n][0].name, float(sizes[n]), _words(sizes[n], seen[n], sightings[n], lens)
        )
        for n in range(len(A))
        if n not in kept
    ]
    doubtful = noise.arm_m > _DOUBTFUL_M or noise.arm_rad > _DOUBTFUL_RAD
    words = hint(sightings, A, seen, lens, camera.width, fixed, rng) if doubtful else ""
    return _finished(problem, state, noise, bad, words)


def _limit(sizes: FloatArray, width: int) -> float:
    """Return the largest residual that is not held against a picture, px."""
    return float(min(max(_SUSPICIOUS * np.median(sizes), _SMALLEST_PX), TOLERATED * width))


def _sizes(
    state: State, sightings: Sequence[Sequence[Sighting]], start: Agreement, A: FloatArray
) -> FloatArray:
    """Return the rms of every picture under a mounting, (N,), px."""
    poses = state.mounting.T_camera_board(A)
    return np.array(
        [
            rms(residuals(state.lens, np.ascontiguousarray(T), each[turn]))
            for T, each, turn in zip(poses, sightings, start.turns, strict=True)
        ]
    )


def _poses_too_few_or_alike(A: FloatArray, under: str) -> str:
    if len(A) < FEWEST_POSES:
        return (
            f"there are {len(A)} pictures with a board and an arm pose{under}; at least "
            f"{FEWEST_POSES} are needed, 15 to 30 are good"
        )
    most, second, _ = turning_deg(A)
    if second < _LEAST_TURN_DEG:
        about = "hardly turned at all" if most < _LEAST_TURN_DEG else "turned about one axis only"
        return (
            f"the arm {about}{under} ({most:.1f}° about one axis, {second:.1f}° about all others), "
            "which leaves the position along that axis open: add poses with the wrist turned by 20 "
            "to 60° about at least two different axes"
        )
    return ""


def _contradiction(start: Agreement, agreeing: int, words: str) -> str:
    typical = float(np.median(start.residual_px))
    return (
        f"pictures and arm poses contradict each other: only {agreeing} of {len(start.turns)} "
        f"agree, and the usual picture is {typical:.0f} px off" + (words and f"; {words}")
    )


def _words(size: float, poses: FloatArray, seen: Sequence[Sighting], lens: FloatArray) -> str:
    alone = rms(residuals(lens, np.ascontiguousarray(poses[0]), seen[0]))
    return (
        f"by the arm's pose its corners belong {pixels(size)} from where they are, although the "
        f"picture by itself fits within {pixels(alone)}: a pose of another picture, taken while "
        "moving, or the board was moved"
    )


def _finished(
    problem: JointProblem, state: State, noise: Noise, bad: Sequence[BadPicture], words: str
) -> MountingFit:
    shares = problem.shares(state, noise)
    free = np.concatenate((problem.free, np.ones(12)))
    steps = steps_without(shares, free)
    left_out = np.array(
        [problem.missed(state.moved(step), number) for number, step in enumerate(steps)]
    )
    X, Y = state.mounting
    return MountingFit(
        problem.fixed,
        state.camera(problem.camera),
        X,
        Y,
        covariance(shares, free, 1.0),
        jackknife(steps),
        noise,
        problem.sightings,
        tuple(problem.residuals(state)),
        left_out[:, 0],
        left_out[:, 1],
        left_out[:, 2],
        turning_deg(problem.A),
        tuple(bad),
        words,
    )
