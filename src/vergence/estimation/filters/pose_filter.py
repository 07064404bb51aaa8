"""The default filter of the target's pose: an error-state Kalman filter on SE(3)."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.estimation.filters.belief import Belief
from vergence.estimation.filters.information import compress, joseph_update, keep_rows
from vergence.estimation.filters.measurement import (
    deletion_squares,
    mahalanobis_squared,
    whitened_rows,
)
from vergence.estimation.filters.motion import predict_covariance
from vergence.estimation.filters.target_filter import (
    Update,
    Verdict,
    fading_share,
    first_values,
    unused,
)
from vergence.estimation.view import Seen
from vergence.geometry import moved_pose
from vergence.parts import knob, part

MEDIAN = 2.0 * np.log(2.0)  # of χ² with the two degrees of freedom of a point
CONSENSUS = 5  # points that must agree to overrule the prediction: any three agree on some pose
GROWTH = 2.0  # of the covariance, for an image too small to prove which pose it contradicts


class Correction(NamedTuple):
    """What the update kernel returns."""

    T_world_target: FloatArray  # (4, 4)
    velocity: FloatArray  # (6,)
    covariance: FloatArray  # (12, 12)
    square: float  # normalised innovation squared of the points kept
    kept: BoolArray  # (M,)
    squares: FloatArray  # (M,)
    agreeing: int  # how many points were kept


@njit(cache=True)
def correct(
    T_world_target: FloatArray,
    velocity: FloatArray,
    P: FloatArray,
    T_camera_world: FloatArray,
    points: FloatArray,
    measured: FloatArray,
    covariance: FloatArray,
    gate: float,
) -> Correction:
    """Correct a predicted state by the points of an exposure, without those beyond the gate.

    A point must pass the gate twice: against the prediction, and against what the prediction and
    all other points say together. While the pose is uncertain only the second finds wrong matches.

    Args:
        T_world_target: predicted pose, (4, 4).
        velocity: predicted (v, ω), (6,).
        P: predicted covariance, (12, 12).
        T_camera_world: inverse pose of each point's camera at the exposure, (M, 4, 4).
        points: in the target's frame, (M, 3), m.
        measured: normalized coordinates, (M, 2).
        covariance: of the measured points, (M, 2, 2).
        gate: on the Mahalanobis distance squared of a point.
    """
    rows = whitened_rows(T_world_target, T_camera_world, points, measured, covariance)
    squares = mahalanobis_squared(rows, P)
    kept = squares <= gate
    while True:
        used = keep_rows(rows, kept)
        rest = compress(used)
        correction, updated, square = joseph_update(P, used)
        alone = deletion_squares(rows, kept, correction, updated)
        worst = np.argmax(alone)
        if alone[worst] <= gate:
            break
        kept[worst] = False
    return Correction(
        moved_pose(T_world_target, correction[:6]),
        velocity + correction[6:],
        updated,
        square + rest,
        kept,
        squares,
        int(np.sum(kept)),
    )


@njit(cache=True)
def predict(
    T_world_target: FloatArray,
    velocity: FloatArray,
    P: FloatArray,
    dt: float,
    densities: tuple[float, float],
) -> tuple[FloatArray, FloatArray]:
    """Return pose (4, 4) and covariance (12, 12) after dt seconds; see `motion`."""
    pose = moved_pose(T_world_target, dt * velocity)
    return pose, predict_covariance(P, velocity, abs(dt), np.array(densities))


@njit(cache=True)
def predict_and_correct(
    T_world_target: FloatArray,
    velocity: FloatArray,
    P: FloatArray,
    dt: float,
    densities: tuple[float, float],
    poses: FloatArray,
    points: FloatArray,
    measured: FloatArray,
    covariance: FloatArray,
    gate: float,
) -> Correction:
    """Predict by dt seconds, then `correct`: in one call, since calls cost more than sums."""
    pose, predicted = predict(T_world_target, velocity, P, dt, densities)
    return correct(pose, velocity, predicted, poses, points, measured, covariance, gate)


@part("filter", "pose")
class PoseFilter:
    """Pose and velocity of a rigid target from any number of cameras, fixed or carried.

    State (p, R, v, ω) with constant velocity, error (δp, δθ, δv, δω) along world axes; see
    `motion` and `measurement` for the equations. It replaces the roll-pitch-yaw state of
    [Lippiello2005] eq. (7) to (18), which is singular at pitch ±90°. The filter itself is a value;
    what it knows about a target is a `Belief`, handed in and returned.

    Images of one exposure enter as one measurement, whose cost depends on its points alone. A
    point beyond the gate is left out only while the prediction agrees with most of them. Where the
    gate would throw out the majority, not the points but the prediction is in doubt: then the
    covariance is enlarged until the median point has its expected distance, and the points are used
    if one pose then explains the majority, five at least. Fewer points prove nothing by themselves:
    they are left out, and if most of the points before them were outside the gate, too, the
    covariance grows until points are let in again.
    """

    # Spectral density of the target's white-noise acceleration.
    acceleration_density: float = knob(0.01, "m²/s³", above=0, upto=1e12)
    # Spectral density of its angular acceleration.
    angular_acceleration_density: float = knob(0.25, "rad²/s³", above=0, upto=1e12)
    # χ² gate with 2 degrees of freedom; the default rejects one valid point in a thousand.
    gate: float = knob(13.8, above=0, upto=1e12)
    # Forgetting factor per image of the consistency test.
    fading: float = knob(0.9, above=0, below=1)

    def start(
        self,
        time: float,
        T_world_target: FloatArray,
        velocity: FloatArray | None = None,
        covariance: FloatArray | None = None,
    ) -> Belief:
        """Return the belief to start from.

        Args:
            time: of the pose, s.
            T_world_target: a rough pose, (4, 4).
            velocity: (v, ω) along world axes, (6,); zero by default.
            covariance: of (δp, δθ, δv, δω), (12, 12), symmetric and at least semidefinite; by
                default 3 cm, 0.1 rad, 0.2 m/s and 0.5 rad/s. [Lippiello2005] starts with zero,
                which makes the first gains zero.

        Raises:
            InputError: if the covariance is not one, or anything is not finite.
        """
        given = first_values("PoseFilter", T_world_target, velocity, covariance)
        return Belief(time, *given)

    def predict(self, belief: Belief, time: float) -> Belief:
        """Return the belief at another time, later or (for a look back over latency) earlier.

        While the innovations are inconsistent the target is taken to accelerate accordingly more.
        Going back moves the pose only; the covariance grows as it would going forward.
        """
        dt = time - belief.time
        if dt == 0.0:
            return belief
        pose, covariance = predict(
            belief.T_world_target,
            belief.velocity,
            belief.covariance,
            dt,
            self._densities(belief),
        )
        return Belief(
            time,
            pose,
            belief.velocity,
            covariance,
            belief.consistency,
            belief.seen,
            belief.doubts,
            belief.disagreeing,
        )

    def _densities(self, belief: Belief) -> tuple[float, float]:
        scale = belief.consistency.scale
        return scale * self.acceleration_density, scale * self.angular_acceleration_density

    def update(self, belief: Belief, seen: Seen) -> Update:
        """Predict to an exposure and correct by its points, of one image or of several."""
        if seen.size == 0:
            return unused(self.predict(belief, seen.time), 0, Verdict.EMPTY)
        found = self._correct(belief, seen)
        disagreeing = fading_share(belief.disagreeing, found.agreeing, seen.size)
        if 2 * found.agreeing >= seen.size:
            return self._used(belief, seen, found, Verdict.USED, disagreeing)
        predicted = replace(self.predict(belief, seen.time), disagreeing=disagreeing)
        return self._overruled(predicted, seen, found)

    def _correct(self, belief: Belief, seen: Seen) -> Correction:
        corrected: Correction = predict_and_correct(
            belief.T_world_target,
            belief.velocity,
            belief.covariance,
            seen.time - belief.time,
            self._densities(belief),
            seen.poses,
            seen.points,
            seen.measured,
            seen.covariance,
            self.gate * belief.consistency.scale,
        )
        return corrected

    def _recorrect(self, belief: Belief, enlarged: float, seen: Seen) -> Correction:
        """Correct what is predicted already, its covariance so many times larger."""
        corrected: Correction = correct(
            belief.T_world_target,
            belief.velocity,
            enlarged * belief.covariance,
            seen.poses,
            seen.points,
            seen.measured,
            seen.covariance,
            self.gate,
        )
        return corrected

    def _used(
        self,
        belief: Belief,
        seen: Seen,
        found: Correction,
        verdict: Verdict,
        disagreeing: float,
        enlarged: float = 1.0,
    ) -> Update:
        freedom = 2 * found.agreeing
        # An exposure counts as if its points were at the gate at most, to be forgotten in time.
        square = min(enlarged * found.square, 0.5 * self.gate * freedom)
        after = Belief(
            seen.time,
            found.T_world_target,
            found.velocity,
            found.covariance,
            belief.consistency.add(square, freedom, self.fading**seen.images),
            seen=seen.time,
            disagreeing=disagreeing,
        )
        return Update(after, verdict, found.kept, found.squares)

    def _overruled(self, belief: Belief, seen: Seen, first: Correction) -> Update:
        """Believe the images rather than the prediction, if their majority agrees on a pose."""
        median = float(np.median(first.squares))
        needed = max(CONSENSUS, (seen.size + 1) // 2)
        if seen.size >= needed and np.isfinite(median):
            enlarged = max(1.0, median / MEDIAN)
            found = self._recorrect(belief, enlarged, seen)
            if found.agreeing >= needed:
                disagreeing = belief.disagreeing
                update = self._used(belief, seen, found, Verdict.RECOVERED, disagreeing, enlarged)
                return update._replace(squares=first.squares)
        if belief.disagreeing > 0.5:
            belief = replace(belief, covariance=GROWTH * belief.covariance)
        doubting = replace(belief, doubts=belief.doubts + seen.images)
        refused = unused(doubting, seen.size, Verdict.CONTRADICTED)
        return refused._replace(squares=first.squares)
