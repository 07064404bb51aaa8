"""The least-squares problem of lens, mounting, board and arm together."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.arm_noise import likeliest_deviations
from vergence.camera.calibration.board_pose import board_pose
from vergence.camera.calibration.hand_eye import Mounting
from vergence.camera.calibration.normal_equations import Share
from vergence.camera.calibration.reprojection import camera_with, reproject, residuals, rms
from vergence.camera.calibration.sighting import Sighting
from vergence.camera.pinhole import Camera
from vergence.geometry import (
    angle_between,
    moved_pose,
    se3,
    se3_adjoint,
    se3_inverse,
    se3_log,
    skew,
    so3_exp,
    so3_left_jacobian,
)

SCALE = 21  # which of the parameters is the logarithm of the board's scale
PARAMETERS = 22  # nine of the lens, six of X, six of Y, and the scale


class Noise(NamedTuple):
    """Standard deviations of what is measured."""

    corner_px: float  # of a corner's coordinate
    arm_m: float = 0.0  # of each coordinate of the flange, from image to image
    arm_rad: float = 0.0  # of its rotation about each axis


class State(NamedTuple):
    """What is estimated."""

    lens: FloatArray  # (9,) in the order of `LENS`
    mounting: Mounting
    log_scale: float  # logarithm of the board's true size over the size given
    arm_errors: FloatArray  # (N, 6) of the recorded poses, in the flange: position m, rotation rad

    def moved(self, step: FloatArray, arm_steps: FloatArray | float = 0.0) -> "State":
        """Return the state after a step (22,): lens; position and rotation of X and Y; scale.

        A rotation vector turns a frame about its own origin, along the axes of its mount.
        """
        X, Y = (
            moved_pose(T, d) for T, d in zip(self.mounting, (step[9:15], step[15:21]), strict=True)
        )
        scale = self.log_scale + float(step[SCALE])
        return State(self.lens + step[:9], Mounting(X, Y), scale, self.arm_errors + arm_steps)

    def camera(self, like: Camera) -> Camera:
        """Return the camera with this lens and the image size of another."""
        return camera_with(self.lens, like)


class Block(NamedTuple):
    """What one image adds to the problem, linearised, in units of standard deviations."""

    J: FloatArray  # (m, 22) slopes by the parameters that all images share
    own: FloatArray  # (m, 6) slopes by the error of this image's arm pose; (m, 0) without
    residual: FloatArray  # (m,)

    @property
    def share(self) -> Share:
        """The block as a part of the normal equations, the arm's error eliminated."""
        return Share.of(self.J, self.residual, self.own if self.own.size else None)

    def own_step(self, step: FloatArray) -> FloatArray:
        """Return how the arm's error changes with a step (22,) of all others, (6,)."""
        return np.asarray(np.linalg.lstsq(self.own, -self.residual - self.J @ step, rcond=None)[0])


@dataclass(frozen=True, slots=True)
class JointProblem:
    """Reprojection of all corners through the chain X⁻¹ A Y, see `hand_eye`.

    Each recorded pose A has an error E of its own, with a prior: X⁻¹ E A Y on the arm, and
    X⁻¹ A E Y where the camera is fixed. So has the board's size. The parameters are in `State`.
    """

    sightings: tuple[Sighting, ...]
    A: FloatArray  # (N, 4, 4) arm poses
    camera: Camera  # for the image's size
    free: FloatArray  # (9,) which parameters of the lens are estimated, 0 or 1
    fixed: bool  # whether the camera is; decides in which link of the chain the arm errs
    scale_deviation: float  # of the board's size, as a share of it; 0 where it is exact

    @property
    def chosen(self) -> FloatArray:
        """Which parameters are estimated, (22,), 0 or 1."""
        return np.concatenate((self.free, np.ones(12), [float(self.scale_deviation > 0.0)]))

    def start(self, lens: FloatArray, mounting: Mounting) -> State:
        """Return the state with this lens and mounting, a board as given and an exact arm."""
        return State(lens, mounting, 0.0, np.zeros((len(self.A), 6)))

    def residuals(self, state: State) -> list[FloatArray]:
        """Return expected less found pixels of each image by its recorded pose, (2n,) each."""
        poses = state.mounting.T_camera_board(self.A)
        return [
            residuals(state.lens, np.ascontiguousarray(T), scaled(seen, state))
            for T, seen in zip(poses, self.sightings, strict=True)
        ]

    def block(self, state: State, n: int, noise: Noise) -> Block:
        """Return what an image adds, linearised at a state."""
        lens, (X, Y), _, errors = state
        seen, E = scaled(self.sightings[n], state), _error(errors[n])
        to_X, A = se3_inverse(X), self.A[n]
        T = np.ascontiguousarray(to_X @ (A @ E if self.fixed else E @ A) @ Y)
        expected, by_lens, by_pose = reproject(lens, T, seen.points)
        by_X = -by_pose @ se3_adjoint(to_X) @ _twist(X[:3, 3])
        by_Y = by_pose @ se3_adjoint(T @ se3_inverse(Y)) @ _twist(Y[:3, 3])
        turned = np.repeat(seen.points @ T[:3, :3].T, 2, axis=0)
        by_scale = np.sum(by_pose[:, :3] * turned, axis=1)[:, None]
        by_arm = by_pose @ se3_adjoint(to_X @ A if self.fixed else to_X) @ _error_twist(errors[n])
        J = np.hstack((by_lens, by_X, by_Y, by_scale)) / noise.corner_px
        residual = (expected - seen.points_px).ravel() / noise.corner_px
        if noise.arm_m == noise.arm_rad == 0.0:
            return Block(J, np.zeros((len(J), 0)), residual)
        prior = 1.0 / np.repeat([noise.arm_m, noise.arm_rad], 3)
        return Block(
            np.vstack((J, np.zeros((6, PARAMETERS)))),
            np.vstack((by_arm / noise.corner_px, np.diag(prior))),
            np.concatenate((residual, prior * errors[n])),
        )

    def prior(self, state: State) -> Share:
        """Return what is known of the board's size, as a part of the normal equations."""
        J = np.zeros((1, PARAMETERS))
        if self.scale_deviation > 0.0:
            J[0, SCALE] = 1.0 / self.scale_deviation
        return Share.of(J, J[:, SCALE] * state.log_scale)

    def noise(self, state: State, corner_px: float) -> Noise:
        """Estimate how far the arm's poses are off: what they and the images disagree by.

        The likeliest deviations of position and rotation, beside what the corners' noise explains;
        none where they make the disagreement hardly likelier.
        """
        misses, explained = [], []
        for n, found in enumerate(self.sightings):
            seen = scaled(found, state)
            T = np.ascontiguousarray(state.mounting.T_camera_board(self.A[n]))
            free = board_pose(state.camera(self.camera), seen)
            to_X = se3_inverse(state.mounting.X)
            to_arm = np.linalg.inv(se3_adjoint(to_X @ self.A[n] if self.fixed else to_X))
            J = reproject(state.lens, T, seen.points)[2]
            misses.append(to_arm @ se3_log(free @ se3_inverse(T)))
            explained.append(to_arm @ np.linalg.inv(J.T @ J) @ to_arm.T * corner_px**2)
        taken_up = len(misses) / (len(misses) - 2.0)  # 12 unknowns of 6 for each image
        arm = likeliest_deviations(np.sqrt(taken_up) * np.array(misses), np.array(explained))
        return Noise(corner_px, *arm)

    def missed(self, state: State, number: int) -> tuple[float, float, float]:
        """Return by how much a state misses an image: rms px, middle of the board m, angle rad."""
        seen = scaled(self.sightings[number], state)
        T = np.ascontiguousarray(state.mounting.T_camera_board(self.A[number]))
        free = board_pose(state.camera(self.camera), seen)
        middle = np.append(seen.points.mean(axis=0), 1.0)
        distance = float(np.linalg.norm((T @ middle - free @ middle)[:3]))
        angle = angle_between(T, free)
        return rms(residuals(state.lens, T, seen)), distance, angle


def scaled(seen: Sighting, state: State) -> Sighting:
    """Return a sighting of the board with the size that a state has for it."""
    return seen._replace(points=np.exp(state.log_scale) * seen.points)


def _error(error: FloatArray) -> FloatArray:
    """Return the error (6,) of an arm pose as a pose (4, 4)."""
    E: FloatArray = se3(so3_exp(error[3:].copy()), error[:3].copy())
    return E


def _error_twist(error: FloatArray) -> FloatArray:
    """Return how the twist of an arm's error, in its mount, follows from its change, (6, 6)."""
    J = so3_left_jacobian(error[3:].copy())
    D = np.eye(6)
    D[3:, 3:] = J
    D[:3, 3:] = skew(error[:3].copy()) @ J
    return D


def _twist(position: FloatArray) -> FloatArray:
    """Return how the twist of a frame at a position follows from a step about itself, (6, 6)."""
    D = np.eye(6)
    D[:3, 3:] = skew(position.copy())
    return D
