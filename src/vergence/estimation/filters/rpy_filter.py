"""The filter of [Lippiello2005]: position, roll-pitch-yaw and their rates."""

from dataclasses import replace
from functools import cached_property

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.estimation.filters.information import compress, joseph_update, keep_rows
from vergence.estimation.filters.measurement import (
    deletion_squares,
    mahalanobis_squared,
    whitened_rows,
)
from vergence.estimation.filters.rpy_belief import RpyBelief, twist_jacobian
from vergence.estimation.filters.target_filter import (
    Update,
    Verdict,
    fading_share,
    first_values,
    unused,
)
from vergence.estimation.view import Seen
from vergence.geometry import matrix_to_rpy, rpy_rates_to_omega, rpy_to_matrix, se3
from vergence.parts import knob, part


@njit(cache=True)
def predict_rpy(
    w: FloatArray, P: FloatArray, dt: float, noise: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return A w and A P Aᵀ + diag(noise), A = [[I, dt I], [0, I]]: eq. (7), (11)."""
    state, half = w.copy(), P.copy()
    for i in range(6):
        state[i] += dt * w[6 + i]
        for j in range(12):
            half[i, j] += dt * P[6 + i, j]
    predicted = half.copy()
    for i in range(12):
        for j in range(6):
            predicted[i, j] += dt * half[i, 6 + j]
        predicted[i, i] += noise[i]
    return state, predicted


@njit(cache=True)
def rpy_rows(
    w: FloatArray,
    T_camera_world: FloatArray,
    points: FloatArray,
    measured: FloatArray,
    covariance: FloatArray,
) -> FloatArray:
    """Return the whitened measurement [C | ζ - g(w)], (2M, 7), eq. (9), (14) to (18).

    The columns of roll, pitch and yaw are those of a rotation along world axes times T_o, (17b).
    """
    rpy = w[3:6]
    T_world_target = se3(rpy_to_matrix(rpy), w[0:3])
    rows = whitened_rows(T_world_target, T_camera_world, points, measured, covariance)
    To = rpy_rates_to_omega(rpy)
    for i in range(len(rows)):
        a, b, c = rows[i, 3], rows[i, 4], rows[i, 5]
        for j in range(3):
            rows[i, 3 + j] = a * To[0, j] + b * To[1, j] + c * To[2, j]
    return rows


@part("filter", "rpy")
class RpyPoseFilter:
    """The extended Kalman filter of [Lippiello2005] section III, kept for reproduction.

    State w = (o, φ, ϑ, ψ, rates), eq. (7) to (18), with these corrections: the noise of a
    measurement is in normalized coordinates (the paper gives px²: divide by the squared focal
    length in pixels); the zero block of (14) has 6 columns; the Joseph form replaces (12b); points
    must pass a gate, against the prediction and against all other points, since without one a
    single wrong corner makes the filter diverge. Angles are never wrapped internally. Near pitch
    ±90° the state is singular and the estimate unreliable; `PoseFilter` has no singularity.
    """

    # Velocity noise in Q per frame, section V.
    velocity_noise: float = knob(5e-6, "m²/s²", least=0, upto=1e6)
    # Angular rate noise in Q per frame.
    angle_rate_noise: float = knob(2e-5, "rad²/s²", least=0, upto=1e6)
    # Frame period for which Q is given.
    frame_period_s: float = knob(1.0 / 26.0, "s", above=0, upto=1e3)
    # Gate on the squared Mahalanobis distance of a point.
    gate: float = knob(13.8, above=0, upto=1e12)
    # Forgetting factor per image of the consistency test.
    fading: float = knob(0.9, above=0, below=1)

    @cached_property
    def noise(self) -> FloatArray:
        """The diagonal of Q, (12,), per frame."""
        return np.repeat([0.0, 0.0, self.velocity_noise, self.angle_rate_noise], 3)

    def start(
        self,
        time: float,
        T_world_target: FloatArray,
        velocity: FloatArray | None = None,
        covariance: FloatArray | None = None,
    ) -> RpyBelief:
        """Return the initial belief, at rest or with a twist (v, ω).

        Args:
            time: of the pose, s.
            T_world_target: a rough pose, (4, 4).
            velocity: (v, ω) along world axes, (6,); zero by default.
            covariance: of (δp, δθ, δv, δω), world axes, (12, 12); by default 3 cm, 0.1 rad, 0.2
                m/s, 0.5 rad/s. The paper's is zero, which makes the first two gains zero.

        Raises:
            InputError: if the covariance is not valid, or any value is not finite.
        """
        given = first_values("RpyPoseFilter", T_world_target, velocity, covariance)
        pose, twist, covariance = given
        rpy = matrix_to_rpy(pose)
        w = np.concatenate((pose[:3, 3], rpy, twist))
        if twist[3:].any():
            w[9:] = np.linalg.pinv(rpy_rates_to_omega(rpy)) @ twist[3:]
        to_state = np.linalg.pinv(twist_jacobian(w))  # singular at pitch ±90°, but not an error
        return RpyBelief(time, w, to_state @ covariance @ to_state.T)

    def predict(self, belief: RpyBelief, time: float) -> RpyBelief:
        """Return the belief at another time; Q is scaled by the number of frames in between."""
        dt = time - belief.time
        if dt == 0.0:
            return belief
        noise = self.noise * (abs(dt) / self.frame_period_s)
        w, P = predict_rpy(belief.vector, belief.vector_covariance, dt, noise)
        return replace(belief, time=time, vector=w, vector_covariance=P)

    def update(self, belief: RpyBelief, seen: Seen) -> Update:
        """Predict to an exposure and update by its points, eq. (11) to (13)."""
        belief = self.predict(belief, seen.time)
        if seen.size == 0:
            return unused(belief, seen.size, Verdict.EMPTY)
        w, P = belief.vector, belief.vector_covariance
        rows = rpy_rows(w, seen.poses, seen.points, seen.measured, seen.covariance)
        squares = mahalanobis_squared(rows, P)
        within = np.isfinite(squares) & (squares <= self.gate)
        if not within.any():
            disagreeing = fading_share(belief.disagreeing, 0, seen.size)
            belief = replace(belief, disagreeing=disagreeing, doubts=belief.doubts + seen.images)
            return unused(belief, seen.size, Verdict.CONTRADICTED)._replace(squares=squares)
        kept, correction, corrected, square = self._correct(rows, P, within)
        count = int(np.count_nonzero(kept))
        disagreeing = fading_share(belief.disagreeing, count, seen.size)
        fading = self.fading**seen.images
        consistency = belief.consistency.add(square, 2 * count, fading)
        after = RpyBelief(
            seen.time, w + correction, corrected, consistency, seen.time, 0, disagreeing
        )
        return Update(after, Verdict.USED, kept, squares)

    def _correct(
        self, rows: FloatArray, P: FloatArray, kept: BoolArray
    ) -> tuple[BoolArray, FloatArray, FloatArray, float]:
        """Return the points kept, the correction, the updated P, and the squared innovation.

        A point must also agree with the prediction and all other points together: while the pose is
        uncertain, as at the start, the prediction alone lets wrong corners pass.
        """
        while True:
            used = keep_rows(rows, kept)
            rest = compress(used)
            correction, updated, square = joseph_update(P, used)
            alone = deletion_squares(rows, kept, correction, updated)
            worst = int(np.argmax(alone))
            if alone[worst] <= self.gate:
                return kept, correction, updated, square + rest
            kept[worst] = False
