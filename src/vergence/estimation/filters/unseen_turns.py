"""Rotations of a target that measurements do not observe: kept as predicted, reported as unknown.

An image of a ball shows none of its rotations, that of a can not the one about its axis, that of a
mug not while its handle is hidden. Such a rotation w may involve a motion of the origin:
F = [δp; w] are the unobservable motions (6, K), with unit, orthogonal rotations. With E = [0; w],
the projector Π = I - F Eᵀ removes them from an error (δp, δθ) and leaves everything else unchanged.
"""

from dataclasses import replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.estimation.filters.belief import Belief
from vergence.geometry import moved_pose, pose_difference

UNKNOWN_RAD = np.pi / np.sqrt(3.0)  # standard deviation of a uniformly distributed angle
MOST_RAD = 0.3  # up to which an unobservable rotation is represented by its growing deviation
_MOST = np.array((MOST_RAD**2, 9.0))  # rad² and rad²/s²
_FIXED_RAD = 1e-4  # during an update by a measurement
_DAMPING = 0.8  # of an unobservable velocity, per image


def without_unseen(belief: Belief, motions: FloatArray) -> Belief:
    """Return a predicted belief in which the unobservable motions are fixed.

    What measurement errors say about such a motion is noise, which would make the target spin.

    Args:
        belief: predicted to the image.
        motions: unobservable in it, (6, K), along world axes, m and rad.
    """
    if not motions.shape[1]:
        return belief
    P = _projected(belief.covariance, motions) + _along(motions, _FIXED_RAD**2)
    return replace(belief, covariance=np.ascontiguousarray(P))


def with_unseen(predicted: Belief, updated: Belief, motions: FloatArray) -> Belief:
    """Return an updated belief whose unobservable motions are as predicted.

    Args:
        predicted: the belief before the update.
        updated: the update of its `without_unseen`.
        motions: (6, K), as there.
    """
    if not motions.shape[1]:
        return updated
    turns: FloatArray = motions[3:]
    ahead = turns.T @ pose_difference(updated.T_world_target, predicted.T_world_target)[3:]
    back = motions @ -ahead
    speed = turns.T @ updated.velocity[3:]
    kept = np.minimum(unseen_variance(predicted, motions), _MOST[:, None])
    P = _projected(updated.covariance, motions) + _along(motions, kept)
    return replace(
        updated,
        T_world_target=moved_pose(updated.T_world_target, back),
        velocity=updated.velocity - (1.0 - _DAMPING) * motions @ speed,
        covariance=np.ascontiguousarray(P),
    )


def with_turn(belief: Belief, motion: FloatArray) -> Belief:
    """Return a belief moved by (δp, δθ), (6,), with an unknown velocity along this motion.

    What was taken for its velocity was that of another turn.
    """
    unit = motion / np.linalg.norm(motion[3:])
    P = belief.covariance + _along(unit[:, None], np.array(((0.0,), _MOST[1:])))
    return replace(
        belief,
        T_world_target=moved_pose(belief.T_world_target, motion),
        velocity=belief.velocity - unit * (unit[3:] @ belief.velocity[3:]),
        covariance=np.ascontiguousarray(P),
    )


def with_undecided(predicted: Belief, updated: Belief, motions: FloatArray) -> Belief:
    """Return an updated belief that is as uncertain as before about rotations, to an extent.

    Each image measures such a rotation near one of several angles that fit it equally well. Until
    one is excluded, their agreement says nothing about which of them is right.

    Args:
        predicted: the belief before the update.
        updated: the update.
        motions: (6, K), with rotations by the largest angle, rad, that fits as well.
    """
    if not motions.shape[1]:
        return updated
    angles = np.linalg.norm(motions[3:], axis=0)
    units = motions / angles
    kept = np.minimum(unseen_variance(predicted, units), _MOST[:, None])
    kept[0] = np.minimum(kept[0], angles**2)
    added = np.maximum(kept - unseen_variance(updated, units), 0.0)
    P = updated.covariance + _along(units, added)
    return replace(updated, covariance=np.ascontiguousarray(P))


def with_unknown(covariance: FloatArray, motions: FloatArray) -> FloatArray:
    """Return a covariance (12, 12) in which motions that no image shows are unknown."""
    P = _projected(covariance, motions) + _along(motions, MOST_RAD**2)
    return np.ascontiguousarray(0.5 * (P + P.T))


def told_covariance(
    belief: Belief, motions: FloatArray, shared: FloatArray, astray: FloatArray
) -> FloatArray:
    """Return the covariance (12, 12) of a belief to be reported.

    A rotation that has been unobservable until its deviation reached the bound may have any angle.

    Args:
        belief: after an image.
        motions: unobservable, (6, K).
        shared: covariance of the pose error common to all images, (6, 6).
        astray: covariance of the additional error while a rotation is unknown, (6, 6); in
            proportion before.
    """
    P = belief.honest_covariance.copy()
    P[:6, :6] += shared
    if not motions.shape[1]:
        return P
    unknown = unseen_variance(belief, motions)
    P[:6, :6] += min(float(unknown[0].max()) / MOST_RAD**2, 1.0) * astray
    unknown[0, unknown[0] > (0.99 * MOST_RAD) ** 2] = UNKNOWN_RAD**2
    return np.ascontiguousarray(_projected(P, motions) + _along(motions, unknown))


def shown_covariance(
    belief: Belief, motions: FloatArray, shared: FloatArray | None = None
) -> FloatArray:
    """Return the covariance (12, 12) with the unobservable motions practically fixed."""
    P = belief.honest_covariance.copy()
    if shared is not None:
        P[:6, :6] += shared
    return _projected(P, motions) + _along(motions, _FIXED_RAD**2) if motions.shape[1] else P


def unseen_variance(belief: Belief, motions: FloatArray) -> FloatArray:
    """Return the variances of unobservable rotations and of their velocities, (2, K), rad and s."""
    turns, P = motions[3:], belief.covariance
    blocks = np.stack((P[3:6, 3:6], P[9:12, 9:12]))
    return np.asarray(np.einsum("ik,nij,jk->nk", turns, blocks, turns))


def _projected(covariance: FloatArray, motions: FloatArray) -> FloatArray:
    """Return Π P Πᵀ, for pose and velocity alike."""
    projector = np.eye(6)
    projector[:, 3:] -= motions @ motions[3:].T
    both = np.kron(np.eye(2), projector)
    return np.asarray(both @ covariance @ both.T)


def _along(motions: FloatArray, variance: FloatArray | float) -> FloatArray:
    """Return F diag(variance) Fᵀ, (12, 12).

    Args:
        motions: F, (6, K).
        variance: of pose and velocity, (2, K), or one for all.
    """
    P = np.zeros((12, 12))
    for n, own in enumerate(np.broadcast_to(variance, (2, motions.shape[1]))):
        block = slice(6 * n, 6 * n + 6)
        P[block, block] = (motions * own) @ motions.T
    return P
