"""Latency, mounting and focal length, estimated from servoing relative to a stationary target."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.camera import Camera
from vergence.geometry import se3, so3_angle, so3_exp, so3_log
from vergence.robot import Arm

NAMES = ("latency_s", "rotation_x", "rotation_y", "rotation_z", "x_m", "y_m", "z_m", "focal")
_PRIOR = np.array([0.1, 0.2, 0.2, 0.2, 0.05, 0.05, 0.05, 0.1])  # deviations before any data
_TOLD = np.array([0.003, *3 * [np.deg2rad(0.15)], *3 * [1e-3], 0.005])  # deviations for reporting
_PRIOR_DEPTH = 0.5  # of the points, relative to the believed depth
_MOST = 120  # number of exposures to keep
_APART_PX = 2.0  # mean motion of the image between two kept exposures
_LATEST_S = 0.25  # latest stamps: joints at earlier exposures are unknown
_FEWEST = 12  # number of exposures below which nothing is reported
_STEP_S = 1e-3  # interval for computing a rate
_STEPS = 25  # of the Levenberg-Marquardt method
_SETTLED = 1e-6  # relative change of the cost at convergence
_OUTLYING = 4.0  # medians of the residuals, beyond which a point is increasingly downweighted
_LEAST_PX = 0.05  # lower bound on the accuracy of a measurement


class SelfCalibration(NamedTuple):
    """The estimated values, each with its standard deviation."""

    latency_s: float  # delay of the stamps after the exposure
    T_believed_camera: FloatArray  # (4, 4) of the true camera in the believed one
    focal: float  # true focal length over the believed one
    deviations: FloatArray  # (8,) of `NAMES`: s, rad, m, relative
    told: BoolArray  # (8,) whether the motion was sufficient to estimate it
    rms_px: float  # of the residuals
    reason: str = ""  # why nothing is estimated at all

    @property
    def rotation_rad(self) -> float:
        """Angle between the true and the believed orientation of the camera."""
        return so3_angle(self.T_believed_camera)

    @property
    def distance_m(self) -> float:
        """Distance between the true and the believed position of the camera."""
        return float(np.linalg.norm(self.T_believed_camera[:3, 3]))

    def __bool__(self) -> bool:
        return bool(self.told.any())


class _State(NamedTuple):
    latency_s: float
    T: FloatArray  # (4, 4) of the true camera in the believed one
    focal: float
    points: FloatArray  # (M, 3) in the world, m


class SelfCalibrator:
    """Collects the data of a run, and estimates the calibration from it on request.

    A camera on the arm sees a stationary point P at p = s π(E⁻¹ T(q(t - τ))⁻¹ P), with the latency
    τ of the stamps, the pose E of the true camera in the believed one, the focal length s times the
    believed one, and T(q) the arm's kinematics up to the believed camera. Points and parameters are
    fitted jointly to the images of the run; weak priors hold what the motion does not determine,
    and the remaining deviation states which values these are.

    Args:
        arm: up to the believed camera.
        camera: its believed intrinsics.
    """

    def __init__(self, arm: Arm, camera: Camera) -> None:
        self._arm, self._camera = arm, camera
        self._joints: list[tuple[float, FloatArray]] = []
        self._images: list[tuple[float, FloatArray, BoolArray]] = []  # normalized points

    def joints(self, time: float, position: FloatArray) -> None:
        """Add joint positions (n,); times must increase."""
        self._joints.append((time, position))

    def image(self, time: float, points_px: FloatArray, found: BoolArray) -> None:
        """Add the same points (M, 2) as measured in one image, with a mask of those found (M,)."""
        if self._images and len(self._images[0][1]) != len(points_px):
            self._images.clear()  # the features have changed
        points = self._camera.normalize(points_px)
        found = found & np.isfinite(points).all(axis=1)
        if self._images:
            both = found & self._images[-1][2]
            moved = np.linalg.norm(points - self._images[-1][1], axis=1)[both]
            if len(moved) and moved.mean() * self._camera.fx < _APART_PX:
                return
        self._images.append((time, points, found))
        if len(self._images) > _MOST:
            del self._images[1::2]  # the same span at half the density

    def estimate(self, depth_m: float) -> SelfCalibration:
        """Return the estimates so far.

        Args:
            depth_m: believed depth of the points in the first image.
        """
        known_from = self._joints[0][0] + _LATEST_S if self._joints else np.inf
        images = [image for image in self._images if image[0] >= known_from]
        if len(images) < _FEWEST:
            return _nothing(f"the image moved in {len(images)} images only")
        if not np.array([found for _, _, found in images]).any(axis=0).all():
            return _nothing("a point was never found")
        problem = _Problem(self._arm, self._camera, self._joints, images, depth_m)
        state, information, rms_px = problem.solved()
        covariance = np.linalg.inv(information)[:8, :8]
        deviations = np.sqrt(np.diag(covariance))
        return SelfCalibration(
            state.latency_s, state.T, state.focal, deviations, deviations < _TOLD, rms_px
        )


class _Problem:
    """The images of a run, and the joint fit of all unknowns to them."""

    def __init__(
        self,
        arm: Arm,
        camera: Camera,
        joints: list[tuple[float, FloatArray]],
        images: list[tuple[float, FloatArray, BoolArray]],
        depth_m: float,
    ) -> None:
        self._arm, self._focal_px = arm, camera.focal_px
        from scipy.interpolate import CubicSpline

        times, positions = zip(*joints, strict=True)
        self._joints_at = CubicSpline(np.array(times), np.array(positions))
        self._span = times[0], times[-1]
        self._stamps = np.array([time for time, _, _ in images])
        self._points = np.array([points for _, points, _ in images])  # (K, M, 2)
        self._found = np.array([found for _, _, found in images])
        self._depth_m = depth_m
        self._start = _State(0.0, np.eye(4), 1.0, self._first_points())

    def solved(self) -> tuple[_State, FloatArray, float]:
        """Return the best state, the information of its parameters, and the residuals' rms, px."""
        state, damping = self._start, 1e-3
        residuals, J = self._linearized(state)
        weights = self._trust(residuals)
        cost = self._cost(state, residuals, weights)
        for _ in range(_STEPS):
            H, g = self._normal(state, residuals, J, weights)
            step: FloatArray = np.linalg.solve(H + damping * np.diag(np.diag(H)), g).astype(float)
            tried = _moved(state, step)
            new_residuals, new_J = self._linearized(tried)
            new_cost = self._cost(tried, new_residuals, weights)
            if not new_cost < cost:
                damping *= 8.0
                if damping > 1e9:
                    break
                continue
            settled = cost - new_cost < _SETTLED * cost
            state, residuals, J, damping = tried, new_residuals, new_J, damping / 8.0
            weights = self._trust(residuals)
            cost = self._cost(state, residuals, weights)
            if settled:
                break
        rms_px = float(np.sqrt((weights * residuals**2).sum() / max(weights.sum(), 1.0)))
        noise_px = max(rms_px, _LEAST_PX)
        information, _ = self._normal(state, residuals, J, weights / noise_px**2)
        return state, information, noise_px

    def _trust(self, residuals: FloatArray) -> FloatArray:
        """Return a weight (K M 2,) of each coordinate; 0 for a wrongly tracked point."""
        size = np.linalg.norm(residuals.reshape(-1, 2), axis=1)
        seen = self._found.ravel()
        scale = max(_OUTLYING * float(np.median(size[seen])), _LEAST_PX)
        trust = np.where(seen, 1.0 / (1.0 + (size / scale) ** 2) ** 2, 0.0)  # Geman and McClure
        return np.repeat(trust, 2)

    def _first_points(self) -> FloatArray:
        """Return the points in the world, each at the believed depth where it is first seen."""
        first = self._found.argmax(axis=0)
        poses = self._poses(self._stamps)
        rays = np.array([[*self._points[k, j], 1.0] for j, k in enumerate(first)])
        seen = self._depth_m * rays
        return np.array(
            [poses[k, :3, :3] @ p + poses[k, :3, 3] for k, p in zip(first, seen, strict=True)]
        )

    def _poses(self, times: FloatArray) -> FloatArray:
        """Return the believed T_world_camera (K, 4, 4) at given times."""
        q = self._joints_at(np.clip(times, *self._span))
        return np.array([self._arm.forward_kinematics(each) for each in q])

    def _linearized(self, state: _State) -> tuple[FloatArray, FloatArray]:
        """Return residuals (K M 2,) in px and their Jacobian (K M 2, 8 + 3 M)."""
        K, M = self._found.shape
        at = self._stamps - state.latency_s
        poses, later = self._poses(at), self._poses(at + _STEP_S)
        X_tip = _into(poses, state.points)  # (K, M, 3)
        rate = (_into(later, state.points) - X_tip) / _STEP_S
        R = state.T[:3, :3]
        X = (X_tip - state.T[:3, 3]) @ R
        z = np.maximum(X[..., 2], 1e-3)
        m = X[..., :2] / z[..., None]
        scale = state.focal * self._focal_px
        D = np.zeros((K, M, 2, 3))  # of the projection
        D[..., 0, 0] = D[..., 1, 1] = 1.0 / z
        D[..., :, 2] = -m / z[..., None]
        D *= scale[:, None]
        J = np.zeros((K, M, 2, 8 + 3 * M))
        J[..., 0] = -np.einsum("kmij,kmj->kmi", D, rate @ R)
        J[..., 1:4] = np.einsum("kmij,kmjl->kmil", D, _crossed(X))
        J[..., 4:7] = -np.einsum("kmij,jl->kmil", D, np.eye(3))
        J[..., 7] = m * self._focal_px
        to_points = np.einsum("kmij,jl,kln->kmin", D, R.T, poses[:, :3, :3].transpose(0, 2, 1))
        for j in range(M):
            J[:, j, :, 8 + 3 * j : 11 + 3 * j] = to_points[:, j]
        residuals = (scale * m - self._focal_px * self._points) * self._found[..., None]
        J *= self._found[..., None, None]
        return np.nan_to_num(residuals).ravel(), J.reshape(-1, 8 + 3 * M)

    def _normal(
        self, state: _State, residuals: FloatArray, J: FloatArray, weights: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the information matrix and the gradient, priors included."""
        priors, off = self._weights(len(state.points)), self._off(state)
        weighted = J * weights[:, None]
        H: FloatArray = weighted.T @ J + np.diag(priors)
        return H, -(weighted.T @ residuals) - priors * off

    def _cost(self, state: _State, residuals: FloatArray, weights: FloatArray) -> float:
        off = self._off(state)
        return float(weights @ residuals**2 + off @ (self._weights(len(state.points)) * off))

    def _weights(self, count: int) -> FloatArray:
        deviations = np.full(3 * count, _PRIOR_DEPTH * self._depth_m)
        return 1.0 / np.concatenate((_PRIOR, deviations)) ** 2

    def _off(self, state: _State) -> FloatArray:
        """Return the deviation of a state from the believed one."""
        rotation = so3_log(np.ascontiguousarray(state.T[:3, :3]))
        first = [state.latency_s, *rotation, *state.T[:3, 3], state.focal - 1.0]
        return np.concatenate((first, (state.points - self._start.points).ravel()))


def _moved(state: _State, step: FloatArray) -> _State:
    """Return a state moved by a step of its parameters, for the camera along its own axes."""
    T = state.T @ se3(so3_exp(step[1:4].copy()), step[4:7].copy())
    points = state.points + step[8:].reshape(-1, 3)
    return _State(state.latency_s + step[0], T, state.focal + step[7], points)


def _into(poses: FloatArray, points: FloatArray) -> FloatArray:
    """Return points (M, 3) of the world in the frames of poses (K, 4, 4), (K, M, 3)."""
    inside: FloatArray = np.einsum(
        "kji,kmj->kmi", poses[:, :3, :3], points[None] - poses[:, None, :3, 3]
    )
    return inside


def _crossed(X: FloatArray) -> FloatArray:
    """Return the matrices [X]× (…, 3, 3) of vectors (…, 3)."""
    x, y, z = np.moveaxis(X, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _nothing(reason: str) -> SelfCalibration:
    return SelfCalibration(
        0.0, np.eye(4), 1.0, _PRIOR.copy(), np.zeros(8, dtype=np.bool_), float("nan"), reason
    )
