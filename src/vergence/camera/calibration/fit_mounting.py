"""Lens, mounting and board together, from images and the arm's poses at their exposures."""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.board_pose import board_pose
from vergence.camera.calibration.failure import CalibrationFailure
from vergence.camera.calibration.hand_eye import (
    TOLERATED,
    Agreement,
    Mounting,
    agree,
    board_in_mount,
    closed_form,
    turning_deg,
)
from vergence.camera.calibration.hints import hint
from vergence.camera.calibration.joint_fit import JointProblem, Noise, State, scaled
from vergence.camera.calibration.mounting_fit import MountingFit
from vergence.camera.calibration.normal_equations import (
    covariance,
    jackknife,
    steps_without,
)
from vergence.camera.calibration.reprojection import lens_of, residuals, rms
from vergence.camera.calibration.sighting import BadImage, Sighting, pixels
from vergence.camera.calibration.solver import Solution, solve
from vergence.camera.pinhole import Camera
from vergence.geometry import angle_between, se3, se3_inverse, so3_exp

FEWEST_POSES = 5
SCALE_DEVIATION = 0.005  # of a board that was measured with a ruler: 1 mm in 200 mm
_LEAST_TURN_DEG = 3.0
_SUSPICIOUS = 5.0  # times the median residual
_SMALLEST_PX = 0.5  # residuals below never count as contradicting
_DOUBTFUL_M, _DOUBTFUL_RAD = 1e-3, np.deg2rad(0.2)  # disagreement for which a reason is sought
_ROUNDS = 6
_NOISE_ROUNDS, _NOISE_SETTLED = 30, 0.01  # share by which the noise may still change
_OTHER_STARTS = 4
_START_M, _START_RAD = 0.05, 0.3  # how far they are from the first
_ALIKE = 6.0  # of the cost: with less between them, two solutions explain the data equally well
_SAME_M, _SAME_RAD = 1e-3, 5e-3  # nearer, two solutions are one


def fit_mounting(
    sightings: Sequence[Sequence[Sighting]],
    T_base_flange: FloatArray,
    camera: Camera,
    noise_px: float,
    *,
    fixed: bool = False,
    free: FloatArray | None = None,
    scale_deviation: float = SCALE_DEVIATION,
    rng: np.random.Generator,
) -> MountingFit | CalibrationFailure:
    """Estimate lens, mounting and board together, leaving out images that contradict the others.

    Args:
        sightings: of each image, one for each orientation that the board may have had in it.
        T_base_flange: the arm's pose at each, (N, 4, 4).
        camera: as the images alone give it, or as it is known.
        noise_px: standard deviation of a corner's coordinate, as the images alone give it.
        fixed: the camera is fixed and the arm carries the board; else the arm carries the camera.
        free: which parameters of the lens are estimated, (9,); none by default.
        scale_deviation: standard deviation of the board's size, as a share of it; 0 if it is exact.
        rng: chooses the images that a start is made of, and other starts.

    Returns:
        the fit, or in words why these images and poses do not determine it.
    """
    A = np.ascontiguousarray(T_base_flange if fixed else [se3_inverse(T) for T in T_base_flange])
    reason = _poses_too_few_or_alike(A, "")
    if reason:
        return CalibrationFailure(reason)
    lens = lens_of(camera)
    seen = np.array([[board_pose(camera, s) for s in each] for each in sightings])
    start = agree(sightings, A, seen, lens, camera.width, rng)

    def mistake() -> str:
        return hint(sightings, A, seen, lens, camera.width, fixed, rng)

    free = np.zeros(9) if free is None else free
    kept = np.flatnonzero(start.residual_px < _limit(start.residual_px, camera.width))
    mounting = start.mounting
    for _ in range(_ROUNDS):
        if 2 * len(kept) <= len(A) or len(kept) < FEWEST_POSES:
            return CalibrationFailure(_contradiction(start, len(kept), mistake()))
        chosen = [sightings[n][int(start.turns[n])] for n in kept.tolist()]
        problem = JointProblem(tuple(chosen), A[kept], camera, free, fixed, scale_deviation)
        solution, noise = _settled(problem, problem.start(lens, mounting), noise_px)
        mounting = solution.state.mounting
        sizes = _sizes(solution.state, sightings, start, A)
        again = np.flatnonzero(sizes <= _limit(sizes[kept], camera.width))
        if np.array_equal(again, kept):
            break
        kept = again
    reason = _poses_too_few_or_alike(A[kept], " without the images that contradict the others")
    if not reason:
        T = seen[kept, start.turns[kept]]
        reason = _doubt(problem, solution, noise, _other_starts(problem, solution, T, rng))
    if reason:
        return CalibrationFailure(reason)
    state = solution.state
    bad = [
        BadImage(
            sightings[n][0].name, float(sizes[n]), _words(sizes[n], seen[n], sightings[n], lens)
        )
        for n in range(len(A))
        if n not in kept
    ]
    doubtful = noise.arm_m > _DOUBTFUL_M or noise.arm_rad > _DOUBTFUL_RAD
    return _finished(problem, state, noise, bad, mistake() if doubtful else "")


def _settled(problem: JointProblem, start: State, noise_px: float) -> tuple[Solution, Noise]:
    """Return the minimum with the noise that is likeliest for it, found in turns."""
    noise = problem.noise(start, noise_px)
    for _ in range(_NOISE_ROUNDS):
        solution = solve(problem, start, noise)
        start, before, noise = solution.state, noise, problem.noise(solution.state, noise_px)
        if np.allclose(noise, before, rtol=_NOISE_SETTLED, atol=1e-6):
            break
    return solution, before


def _other_starts(
    problem: JointProblem, solution: Solution, T: FloatArray, rng: np.random.Generator
) -> list[State]:
    """Return starts far from a solution: the closed form, and mountings moved at random.

    Args:
        problem: whose solution it is.
        solution: from the first start.
        T: poses of the board in the camera, (N, 4, 4).
        rng: moves them.
    """
    mountings = [closed_form(problem.A, T)]
    X = solution.state.mounting.X
    for _ in range(_OTHER_STARTS):
        turn = so3_exp(rng.normal(0.0, _START_RAD, 3))
        moved = se3(turn @ X[:3, :3], X[:3, 3] + rng.normal(0.0, _START_M, 3))
        mountings.append(Mounting(moved, board_in_mount(problem.A, T, moved)))
    return [problem.start(solution.state.lens, mounting) for mounting in mountings]


def _doubt(problem: JointProblem, solution: Solution, noise: Noise, starts: list[State]) -> str:
    """Return why a solution is not the one, judged by those from other starts; empty if it is."""
    others = [solve(problem, start, noise) for start in starts]
    if not solution.converged:
        return (
            "the fit of images and arm poses did not converge: add images, or remove those "
            "whose pose is doubtful"
        )
    for other in others:
        X, Y = solution.state.mounting.X, other.state.mounting.X
        apart_m = float(np.linalg.norm(X[:3, 3] - Y[:3, 3]))
        apart_rad = angle_between(X, Y)
        as_good = other.converged and other.cost < solution.cost + _ALIKE
        if as_good and (apart_m > _SAME_M or apart_rad > _SAME_RAD):
            return (
                "images and arm poses fit two mountings about equally well, "
                f"{1e3 * apart_m:.0f} mm and {np.rad2deg(apart_rad):.1f}° apart: add poses with "
                "the wrist turned by 20 to 60° about other axes"
            )
    return ""


def _limit(sizes: FloatArray, width: int) -> float:
    """Return the largest residual that does not count as contradicting, px."""
    return float(min(max(_SUSPICIOUS * np.median(sizes), _SMALLEST_PX), TOLERATED * width))


def _sizes(
    state: State, sightings: Sequence[Sequence[Sighting]], start: Agreement, A: FloatArray
) -> FloatArray:
    """Return the rms of every image under a mounting, (N,), px."""
    poses = state.mounting.T_camera_board(A)
    return np.array(
        [
            rms(residuals(state.lens, np.ascontiguousarray(T), scaled(each[turn], state)))
            for T, each, turn in zip(poses, sightings, start.turns, strict=True)
        ]
    )


def _poses_too_few_or_alike(A: FloatArray, under: str) -> str:
    if len(A) < FEWEST_POSES:
        return (
            f"there are {len(A)} images with a board and an arm pose{under}; at least "
            f"{FEWEST_POSES} are needed, 15 to 30 are good"
        )
    most, second, _ = turning_deg(A)
    if second < _LEAST_TURN_DEG:
        about = "hardly turned at all" if most < _LEAST_TURN_DEG else "turned about one axis only"
        return (
            f"the arm {about}{under} ({most:.1f}° about one axis, {second:.1f}° about all others), "
            "which does not determine the position along that axis: add poses with the "
            "wrist turned "
            "by 20 to 60° about at least two different axes"
        )
    return ""


def _contradiction(start: Agreement, agreeing: int, words: str) -> str:
    typical = float(np.median(start.residual_px))
    return (
        f"images and arm poses contradict each other: only {agreeing} of {len(start.turns)} "
        f"agree, and the usual image is {typical:.0f} px off" + (words and f"; {words}")
    )


def _words(size: float, poses: FloatArray, seen: Sequence[Sighting], lens: FloatArray) -> str:
    alone = rms(residuals(lens, np.ascontiguousarray(poses[0]), seen[0]))
    return (
        f"its corners are {pixels(size)} from where the arm's pose puts them, although the image "
        f"alone fits within {pixels(alone)}: the pose of another image, an image taken in motion, "
        "or a board that was moved"
    )


def _finished(
    problem: JointProblem, state: State, noise: Noise, bad: Sequence[BadImage], words: str
) -> MountingFit:
    count, prior = len(problem.A), problem.prior(state)
    shares = [problem.block(state, n, noise).share for n in range(count)]
    steps = steps_without(shares, problem.chosen, [prior])
    left_out = np.array([problem.missed(state.moved(steps[n]), n) for n in range(count)])
    X, Y = state.mounting
    return MountingFit(
        problem.fixed,
        state.camera(problem.camera),
        X,
        Y,
        float(np.exp(state.log_scale)),
        covariance([*shares, prior], problem.chosen, 1.0),
        jackknife(steps),
        noise,
        problem.scale_deviation,
        problem.sightings,
        tuple(problem.residuals(state)),
        left_out[:, 0],
        left_out[:, 1],
        left_out[:, 2],
        turning_deg(problem.A),
        tuple(bad),
        words,
    )
