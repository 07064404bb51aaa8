"""Models of the motion between two views, fitted and compared."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.geometry import angle_between, so3_log
from vergence.geometry.chi_square import chi_square_quantile, normal_deviate_of_ratio
from vergence.vision.two_view import bundle
from vergence.vision.two_view.bundle import GENERAL, PLANE, ROTATION, TwoViewState
from vergence.vision.two_view.covariance import bundle_covariance
from vergence.vision.two_view.decomposition import decompose_homography, inverse_depths
from vergence.vision.two_view.linear import linear_homography
from vergence.vision.two_view.motions import AIMED, TURNED, motion_minima, rotation_between

ITERATIONS = 25  # most steps of bundle adjustment
FEWEST_GENERAL = 8  # matches of an object that is not flat
RIVAL = 13.8  # χ² difference that excludes a second motion: odds of one to a thousand
LIKELY = 1.64  # standard deviations: 95 %
NO_PLANE = 4.5  # standard deviations beyond which a plane is excluded
NOISE_FROM = 16  # matches from which the noise can be estimated
_CAP = 13.8  # on the χ² of a single match, which may be wrong
_FAR = 21.1  # χ² of a rotation: one in ten thousand
_TENTH = 0.1  # share of points that may be nearer, or farther, than the depths of the others
_ISOLATED = 1.5  # extents of these depths from their middle, beyond which a point is isolated
_SURE = 3.0  # standard deviations, by which it has to be
_MOTIONS = 4  # largest number that is adjusted
_BEHIND = 0.1  # fraction of points that may lie behind a camera: distant ones, because of noise


class Views:
    """The matches in normalized coordinates, with the noise assumed for them."""

    def __init__(
        self, m_star: FloatArray, m: FloatArray, weight: FloatArray, index: IntArray | None = None
    ) -> None:
        self.m_star, self.m, self.weight = m_star, m, weight
        self.index = np.arange(len(m)) if index is None else index  # index among all matches

    def __len__(self) -> int:
        return len(self.m)

    def take(self, chosen: BoolArray) -> "Views":
        """Return a subset of the matches."""
        return Views(self.m_star[chosen], self.m[chosen], self.weight, self.index[chosen])

    @property
    def noise(self) -> float:
        """Standard deviation of a normalized coordinate."""
        return float(np.mean(1.0 / self.weight))

    def adjust(self, model: int, state: TwoViewState) -> "Fit":
        """Return an optimised model, starting from a first guess."""
        state, residuals = bundle.adjust_bundle(
            model, state, self.m_star, self.m, self.weight, ITERATIONS
        )
        return Fit(self, model, state, residuals)


class Fit:
    """An optimised model."""

    def __init__(
        self, views: Views, model: int, state: TwoViewState, residuals: FloatArray
    ) -> None:
        self.views, self.model, self.state, self.residuals = views, model, state, residuals
        self.chi_square = float(np.sum(residuals**2))
        poses, a_point = bundle.bundle_sizes(model)
        self.freedom = (4 - a_point) * len(views) - poses

    @property
    def front(self) -> BoolArray:
        """Which points are in front of both cameras, (N,)."""
        before: BoolArray = (self.state.w > 0.0) & (self.depths > 0.0)
        return before

    @property
    def isolated(self) -> BoolArray:
        """Which points have an inverse depth far from those of the others, (N,)."""
        w, views = self.state.w, self.views
        blocks = bundle.normal_blocks(self.model, self.state, self.residuals, views.weight)
        deviation = np.sqrt(np.linalg.inv(blocks.V)[:, 2, 2])
        low, high = np.quantile(w, (_TENTH, 1.0 - _TENTH))
        beyond = np.abs(w - 0.5 * (low + high)) - _ISOLATED * (high - low)
        far: BoolArray = beyond > _SURE * deviation
        return far

    @property
    def depths(self) -> FloatArray:
        """Depths of the points in the current camera over those in the desired one, (N,)."""
        rays = np.column_stack((self.state.x_star, np.ones(len(self.views))))
        depths: FloatArray = rays @ self.state.R[2] + self.state.w * self.state.t[2]
        return depths

    def misses(self, scale: float) -> float:
        """Return χ² with a limited contribution of each match, since one may be wrong."""
        squares = np.sum(self.residuals**2, axis=1) / scale
        return float(np.minimum(squares, _CAP).sum())

    def differs_from(self, other: "Fit") -> bool:
        """Return whether two motions of a general object are different."""
        cosine = np.clip(self.state.t @ other.state.t, -1.0, 1.0)
        return bool(
            angle_between(self.state.R, other.state.R) > TURNED or np.arccos(cosine) > AIMED
        )


class Comparison(NamedTuple):
    """The simplest model that explains the matches, and its rivals."""

    fits: list[Fit]  # the selected one, and all that the noise cannot distinguish from it
    plane: Fit  # the best plane, selected or not
    scale: float  # variance of the noise over the stated one, at least 1


def compare_models(views: Views) -> Comparison:
    """Select among rotation, plane and general object by likelihood ratio.

    The models are nested, so twice the log ratio is χ² with as many degrees of freedom as the
    larger model has additional unknowns [Wilks1938]: a simpler model is kept unless the ratio
    exceeds 99.9 %, but is the only one only within 95 %. The noise is estimated from the largest
    model, since lens and matcher may add to the stated noise; a plane therefore remains a rival
    unless the ratio of mean squares excludes it, which accounts for how little few matches reveal
    about their noise. All local minima of the general model are compared with each other as well.
    """
    count = len(views)
    state = TwoViewState(
        rotation_between(views.m_star, views.m),
        np.zeros(3),
        np.array([0.0, 0.0, 1.0]),
        views.m_star,
        np.ones(count),
    )
    turn = views.adjust(ROTATION, state)
    rotations, translations, normals = decompose_homography(
        linear_homography(views.m_star, views.m)
    )
    plane = views.adjust(PLANE, state._replace(R=rotations[0], t=translations[0], n=normals[0]))
    general = general_fits(views, state) if count >= FEWEST_GENERAL else []
    largest = general[0] if general else plane
    scale = max(1.0, largest.chi_square / max(largest.freedom, 1))

    def gained(simple: Fit, full: Fit) -> float:
        return simple.misses(scale) - full.misses(scale)

    unknowns = {ROTATION: turn.freedom - largest.freedom, PLANE: plane.freedom - largest.freedom}
    if gained(turn, plane) <= chi_square_quantile(5) + 1e-6 and gained(
        turn, largest
    ) <= chi_square_quantile(unknowns[ROTATION]):
        return Comparison([turn], plane, scale)
    rivals = [f for f in general if f.chi_square - general[0].chi_square <= RIVAL * scale]
    gain = gained(plane, largest)
    if gain <= chi_square_quantile(unknowns[PLANE], LIKELY) + 1e-6:
        return Comparison([plane], plane, scale)
    if gain <= chi_square_quantile(unknowns[PLANE]):
        return Comparison([plane, *rivals], plane, scale)
    # The noise left by the largest model is an estimate; few matches must not increase it.
    known = scale == 1.0 and count < NOISE_FROM
    deviate = normal_deviate_of_ratio(
        gain / unknowns[PLANE], unknowns[PLANE], np.inf if known else largest.freedom
    )
    return Comparison([*rivals, plane] if deviate < NO_PLANE else rivals, plane, scale)


def hinging_on_one(views: Views, best: Fit, scale: float) -> list[Fit]:
    """Return the fits to all matches but one that are far from the fit to all.

    A wrong match among few can distort the motion so that it agrees. If the motion without it
    differs, by the deviations of either, the matches are inconclusive.
    """
    others: list[Fit] = []
    for j in range(len(views)):
        kept = np.arange(len(views)) != j
        state = best.state._replace(x_star=best.state.x_star[kept], w=best.state.w[kept])
        fit = views.take(kept).adjust(best.model, state)
        blocks = bundle.normal_blocks(fit.model, fit.state, fit.residuals, views.weight)
        C = scale * bundle_covariance(blocks, np.zeros(0, dtype=np.int64))[:3, :3]
        turn = so3_log(np.ascontiguousarray(fit.state.R @ best.state.R.T))
        # Without a match the motion may be undetermined: then it is no rival.
        far = turn @ np.linalg.pinv(C, hermitian=True) @ turn > _FAR
        if far and all(fit.differs_from(o) for o in others):
            others.append(fit)
    return others[:_MOTIONS]


def general_fits(views: Views, state: TwoViewState) -> list[Fit]:
    """Return the local minima of the motion of an object of any shape, the best first."""
    motions = motion_minima(views.m_star, views.m, 2 * _MOTIONS, 9.0 * views.noise**2)
    fits: list[Fit] = []
    for R, t in zip(motions.R[:_MOTIONS], motions.t, strict=False):
        depths, _ = inverse_depths(R, t, views.m_star, views.m)
        fit = views.adjust(GENERAL, state._replace(R=R, t=t, w=np.maximum(depths, 1e-3)))
        possible = np.mean(~fit.front) <= _BEHIND
        if possible and all(fit.differs_from(other) for other in fits):
            fits.append(fit)
    return sorted(fits, key=lambda fit: fit.chi_square)
