"""The models of what happened between two views, fitted and judged."""

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.vision.two_view import bundle
from vergence.vision.two_view.bundle import GENERAL, PLANE, ROTATION, TwoViewState
from vergence.vision.two_view.checks import chi_square_quantile
from vergence.vision.two_view.decomposition import decompose_homography, inverse_depths
from vergence.vision.two_view.linear import linear_homography
from vergence.vision.two_view.search import find_inliers, fit_general, rotation_between

ITERATIONS = 25  # most steps of bundle adjustment
GATE = 3.29  # standard deviations beyond which a match is wrong (one in a thousand)


class Views:
    """The matches in normalized coordinates, with the noise they are judged by."""

    def __init__(self, m_star: FloatArray, m: FloatArray, weight: FloatArray) -> None:
        self.m_star, self.m, self.weight = m_star, m, weight

    def __len__(self) -> int:
        return len(self.m)

    def take(self, chosen: BoolArray) -> "Views":
        """Return the chosen matches alone."""
        return Views(self.m_star[chosen], self.m[chosen], self.weight)

    @property
    def variance(self) -> float:
        """Of a normalized coordinate."""
        return float(np.mean(1.0 / self.weight) ** 2)

    def adjust(self, model: int, state: TwoViewState) -> "Fit":
        """Return a model at its best, from a first guess."""
        state, residuals = bundle.adjust_bundle(
            model, state, self.m_star, self.m, self.weight, ITERATIONS
        )
        return Fit(self, model, state, residuals)


class Fit:
    """A model at its best, and whether the noise explains what is left."""

    def __init__(
        self, views: Views, model: int, state: TwoViewState, residuals: FloatArray
    ) -> None:
        self.views, self.model, self.state, self.residuals = views, model, state, residuals
        self.chi_square = float(np.sum(residuals**2))
        poses, a_point = bundle.bundle_sizes(model)
        self.freedom = (4 - a_point) * len(views) - poses

    @property
    def accepted(self) -> bool:
        """Whether noise explains the residuals, and the points lie before the camera."""
        possible = self.model != GENERAL or bool((self.state.w > 0).all())
        return possible and self.chi_square <= chi_square_quantile(self.freedom) + 1e-6


def simplest_fit(views: Views) -> Fit | None:
    """Return the simplest of turn, plane and general object that the noise explains."""
    count = len(views)
    start = TwoViewState(
        rotation_between(views.m_star, views.m),
        np.zeros(3),
        np.array([0.0, 0.0, 1.0]),
        views.m_star,
        np.ones(count),
    )
    turn = views.adjust(ROTATION, start)
    if turn.accepted:
        return turn
    rotations, translations, normals = decompose_homography(
        linear_homography(views.m_star, views.m)
    )
    plane = views.adjust(PLANE, start._replace(R=rotations[0], t=translations[0], n=normals[0]))
    if count < 8:
        return plane if plane.accepted else None
    R, t, _ = fit_general(views.m_star, views.m, 5, 9.0 * views.variance)
    depths, _ = inverse_depths(R, t, views.m_star, views.m)
    general = views.adjust(GENERAL, start._replace(R=R, t=t, w=np.maximum(depths, 1e-3)))
    # A plane is a general object with N − 3 fewer unknowns: keep it unless the rest gains more.
    shaped = plane.chi_square - general.chi_square > chi_square_quantile(count - 3)
    if plane.accepted and not (general.accepted and shaped):
        return plane
    return general if general.accepted else None


def robust_inliers(views: Views) -> BoolArray:
    """Return which matches agree on a plane's motion or, if clearly more do, on any motion."""
    gate = GATE**2 * views.variance
    # The mean of both directions of transfer has twice the freedom of one Sampson distance.
    plane = find_inliers(False, views.m_star, views.m, 1.5 * gate)
    if len(views) < 9:
        return plane
    general = find_inliers(True, views.m_star, views.m, gate)
    return general if general.sum() >= max(8, plane.sum() + 3) else plane
