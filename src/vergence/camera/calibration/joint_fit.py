"""The least-squares problem of lens, mounting and board together."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.arm_noise import likeliest_deviations
from vergence.camera.calibration.hand_eye import Mounting
from vergence.camera.calibration.lens_fit import board_pose
from vergence.camera.calibration.normal_equations import Share
from vergence.camera.calibration.reprojection import camera_with, reproject, residuals, rms
from vergence.camera.calibration.sighting import Sighting
from vergence.camera.pinhole import Camera
from vergence.geometry import (
    se3,
    se3_adjoint,
    se3_inverse,
    se3_log,
    skew,
    so3_exp,
    so3_left_jacobian,
    so3_log,
)


class Noise(NamedTuple):
    """Standard deviations of what is measured."""

    corner_px: float  # of a corner's coordinate
    arm_m: float = 0.0  # of each coordinate of the flange, from picture to picture
    arm_rad: float = 0.0  # of its rotation about each axis


class State(NamedTuple):
    """What is estimated."""

    lens: FloatArray  # (9,) in the order of `LENS`
    mounting: Mounting

    def moved(self, step: FloatArray) -> "State":
        """Return the state after a step (21,): lens; position and rotation of camera and board.

        A rotation vector turns a frame about its own origin, along the axes of its mount.
        """
        X, Y = (
            se3(so3_exp(d[3:].copy()) @ T[:3, :3], T[:3, 3] + d[:3])
            for T, d in zip(self.mounting, (step[9:15], step[15:]), strict=True)
        )
        return State(self.lens + step[:9], Mounting(X, Y))

    def camera(self, like: Camera) -> Camera:
        """Return the camera with this lens and the picture size of another."""
        return camera_with(self.lens, like)


@dataclass(frozen=True, slots=True)
class JointProblem:
    """Reprojection of all corners through the chain X⁻¹ A Y, see `hand_eye`.

    Parameters are steps from a state, (21,): nine of the lens, six of X, six of Y.
    """

    sightings: tuple[Sighting, ...]
    A: FloatArray  # (N, 4, 4) arm poses
    camera: Camera  # for the picture's size
    free: FloatArray  # (9,) which parameters of the lens are estimated, 0 or 1
    fixed: bool  # whether the camera is; decides in which link of the chain the arm errs

    def solved(self, state: State, noise: Noise) -> State:
        """Return the state that minimises the squared residuals, weighted by the noise."""
        from scipy.optimize import least_squares

        chosen = np.flatnonzero(np.concatenate((self.free, np.ones(12))))
        weigh = [self._weight(state, n, noise) for n in range(len(self.A))]

        def whole(part: FloatArray) -> FloatArray:
            step = np.zeros(21)
            step[chosen] = part
            return step

        def residual(part: FloatArray) -> FloatArray:
            left = self.residuals(state.moved(whole(part)))
            return np.concatenate([W @ r for W, r in zip(weigh, left, strict=True)])

        def jacobian(part: FloatArray) -> FloatArray:
            step = whole(part)
            rows = [self._slopes(state, step, n)[:, chosen] for n in range(len(self.A))]
            return np.vstack([W @ J for W, J in zip(weigh, rows, strict=True)])

        start = np.zeros(len(chosen))
        found = least_squares(residual, start, jac=jacobian, method="lm", x_scale="jac", xtol=1e-12)
        return state.moved(whole(found.x))

    def residuals(self, state: State) -> list[FloatArray]:
        """Return expected less found pixels of each picture, (2n,) each."""
        poses = state.mounting.T_camera_board(self.A)
        return [
            residuals(state.lens, np.ascontiguousarray(T), seen)
            for T, seen in zip(poses, self.sightings, strict=True)
        ]

    def shares(self, state: State, noise: Noise) -> list[Share]:
        """Return what each picture adds to the normal equations, weighted by the noise."""
        parts, none = [], np.zeros(21)
        for n, residual in enumerate(self.residuals(state)):
            W = self._weight(state, n, noise)
            parts.append(Share.of(W @ self._slopes(state, none, n), W @ residual))
        return parts

    def noise(self, state: State, corner_px: float) -> Noise:
        """Estimate how far the arm's poses are off: what they and the pictures disagree by.

        The likeliest deviations of position and rotation, beside what the corners' noise explains;
        none where they make the disagreement hardly likelier.
        """
        misses, explained = [], []
        for n, seen in enumerate(self.sightings):
            T = np.ascontiguousarray(state.mounting.T_camera_board(self.A[n]))
            free = board_pose(state.camera(self.camera), seen)
            to_arm = np.linalg.inv(self._arm_to_camera(state, n))
            J = reproject(state.lens, T, seen.points)[2]
            misses.append(to_arm @ se3_log(free @ se3_inverse(T)))
            explained.append(to_arm @ np.linalg.inv(J.T @ J) @ to_arm.T * corner_px**2)
        taken_up = len(misses) / (len(misses) - 2.0)  # 12 unknowns of 6 for each picture
        arm = likeliest_deviations(np.sqrt(taken_up) * np.array(misses), np.array(explained))
        return Noise(corner_px, *arm)

    def missed(self, state: State, number: int) -> tuple[float, float, float]:
        """Return by how much a state misses a picture: rms px, middle of the board m, angle rad."""
        seen = self.sightings[number]
        T = np.ascontiguousarray(state.mounting.T_camera_board(self.A[number]))
        free = board_pose(state.camera(self.camera), seen)
        middle = np.append(seen.points.mean(axis=0), 1.0)
        distance = float(np.linalg.norm((T @ middle - free @ middle)[:3]))
        angle = float(np.linalg.norm(so3_log(T[:3, :3].T @ free[:3, :3])))
        return rms(residuals(state.lens, T, seen)), distance, angle

    def _slopes(self, start: State, step: FloatArray, n: int) -> FloatArray:
        """Return the slope of a picture's residuals by the step, (2n, 21)."""
        lens, (X, Y) = start.moved(step)
        T = se3_inverse(X) @ self.A[n] @ Y
        _, by_lens, by_pose = reproject(lens, T, self.sightings[n].points)
        by_X = -by_pose @ se3_adjoint(se3_inverse(X)) @ _twist(X, step[9:15])
        by_Y = by_pose @ se3_adjoint(se3_inverse(X) @ self.A[n]) @ _twist(Y, step[15:])
        return np.hstack((by_lens, by_X, by_Y))

    def _arm_to_camera(self, state: State, n: int) -> FloatArray:
        """Return what turns an error of the flange, along its axes, into the board's, (6, 6)."""
        T = se3_inverse(state.mounting.X)
        return np.array(se3_adjoint(T @ self.A[n]) if self.fixed else -se3_adjoint(T))

    def _weight(self, state: State, n: int, noise: Noise) -> FloatArray:
        """Return W with W C Wᵀ = 1 for the covariance C of a picture's residuals, (2n, 2n)."""
        seen, own = self.sightings[n], noise.corner_px
        if noise.arm_m == noise.arm_rad == 0.0:
            return np.eye(2 * seen.size) / own
        T = np.ascontiguousarray(state.mounting.T_camera_board(self.A[n]))
        by_arm = reproject(state.lens, T, seen.points)[2] @ self._arm_to_camera(state, n)
        by_arm = by_arm * np.repeat([noise.arm_m, noise.arm_rad], 3)
        # C = σ² + B Bᵀ has six directions of its own; in all others W is 1/σ.
        U, s, _ = np.linalg.svd(by_arm, full_matrices=False)
        shrink = 1.0 / np.hypot(s, own) - 1.0 / own
        return np.asarray(np.eye(2 * seen.size) / own + (U * shrink) @ U.T)


def _twist(T: FloatArray, step: FloatArray) -> FloatArray:
    """Return how the twist of a frame, in its mount, follows from a step's change, (6, 6).

    The step (t, w) has moved the frame to T = (exp(w) R, p + t).
    """
    D, J = np.eye(6), so3_left_jacobian(step[3:].copy())
    D[3:, 3:] = J
    D[:3, 3:] = skew(T[:3, 3].copy()) @ J
    return D
