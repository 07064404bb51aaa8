"""From matched points in two pictures to motion and structure."""

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.camera import Camera
from vergence.errors import InputError, ShapeError
from vergence.vision.two_view import bundle
from vergence.vision.two_view.bundle import GENERAL, PLANE, ROTATION, TwoViewState
from vergence.vision.two_view.checks import (
    chi_square_quantile,
    distinct_count,
    fewest_off_a_line,
    widest_triples,
)
from vergence.vision.two_view.covariance import (
    points_in_desired,
    reference_plane,
    upsilon_covariance,
)
from vergence.vision.two_view.decomposition import decompose_homography, inverse_depths
from vergence.vision.two_view.failure import TwoViewFailure, TwoViewProblem
from vergence.vision.two_view.linear import homogeneous, linear_homography
from vergence.vision.two_view.result import TwoView
from vergence.vision.two_view.search import find_inliers, fit_general, rotation_between

ITERATIONS = 25  # most steps of bundle adjustment
GATE = 3.29  # standard deviations beyond which a match is wrong (one in a thousand)


class _Views:
    """The matches in normalized coordinates, with the noise they are judged by."""

    def __init__(self, m_star: FloatArray, m: FloatArray, weight: FloatArray) -> None:
        self.m_star, self.m, self.weight = m_star, m, weight

    def __len__(self) -> int:
        return len(self.m)

    def take(self, chosen: BoolArray) -> "_Views":
        return _Views(self.m_star[chosen], self.m[chosen], self.weight)

    @property
    def variance(self) -> float:
        """Of a normalized coordinate."""
        return float(np.mean(1.0 / self.weight) ** 2)

    def adjust(self, model: int, state: TwoViewState) -> "_Fit":
        state, residuals = bundle.adjust_bundle(
            model, state, self.m_star, self.m, self.weight, ITERATIONS
        )
        return _Fit(self, model, state, residuals)


class _Fit:
    """A model at its best, and whether the noise explains what is left."""

    def __init__(
        self, views: _Views, model: int, state: TwoViewState, residuals: FloatArray
    ) -> None:
        self.views, self.model, self.state, self.residuals = views, model, state, residuals
        self.chi_square = float(np.sum(residuals**2))
        poses, a_point = bundle.bundle_sizes(model)
        self.freedom = (4 - a_point) * len(views) - poses

    @property
    def accepted(self) -> bool:
        possible = self.model != GENERAL or bool((self.state.w > 0).all())
        return possible and self.chi_square <= chi_square_quantile(self.freedom) + 1e-6


def estimate_two_view(
    points_px: FloatArray,
    points_star_px: FloatArray,
    camera: Camera,
    *,
    noise_px: float = 0.5,
    reference: IntArray | None = None,
    normal_hint: FloatArray | None = None,
) -> TwoView | TwoViewFailure:
    """Reconstruct motion and shape of an unknown object, up to scale, from two pictures of it.

    Nothing need be known of the object: a flat one is found to be flat (four matches suffice), any
    other takes eight. First guesses are linear, then both views are adjusted together, and the
    simplest model that the noise allows is kept. Wrong matches are found and dropped.

    Args:
        points_px: the points in the current view, (N, 2).
        points_star_px: the same points in the desired view, (N, 2).
        camera: that took both pictures.
        noise_px: standard deviation of a measured coordinate; what is explained by it is noise.
        reference: indices of three or more points that span the reference plane; by default the
            three that are spread most. A flat object is its own reference plane.
        normal_hint: where the normal of a flat object is thought to point (desired frame, away
            from the camera); it decides where two motions are possible. Default: along the
            optical axis.

    Returns:
        the reconstruction, or why there is none.

    Raises:
        ShapeError: if the two lists differ in shape.
        InputError: if a reference index is not one of the points, or there are fewer than three.
    """
    points_px = np.ascontiguousarray(points_px, dtype=np.float64)
    points_star_px = np.ascontiguousarray(points_star_px, dtype=np.float64)
    if points_px.ndim != 2 or points_px.shape[1] != 2:
        raise ShapeError("points_px", points_px.shape, (None, 2))
    if points_star_px.shape != points_px.shape:
        raise ShapeError("points_star_px", points_star_px.shape, points_px.shape)
    if reference is not None:
        reference = _checked_reference(reference, len(points_px))
    failure = _degenerate(points_px, points_star_px, noise_px)
    if failure is not None:
        return failure
    views = _Views(
        np.ascontiguousarray(camera.normalize(points_star_px)),
        np.ascontiguousarray(camera.normalize(points_px)),
        camera.focal_px / noise_px,
    )
    hint = np.array([0.0, 0.0, 1.0]) if normal_hint is None else np.asarray(normal_hint)
    inliers = np.ones(len(views), dtype=np.bool_)
    fit = _simplest_fit(views)
    if fit is None:
        inliers = _robust_inliers(views)
        fit = _simplest_fit(views.take(inliers)) if inliers.sum() >= 5 else None
    if fit is None:
        return TwoViewFailure(
            TwoViewProblem.WRONG_MATCHES,
            f"no motion explains enough of the {len(views)} matches within {noise_px} px of noise",
        )
    if fit.model == ROTATION:
        return TwoViewFailure(
            TwoViewProblem.NO_TRANSLATION,
            "a turn of the camera alone explains both views, so the object's shape is unknown",
            fit.state.R.T.copy(),
        )
    if fit.model == PLANE:
        return _planar_result(fit, inliers, hint, noise_px)
    return _general_result(fit, inliers, reference, noise_px)


def _checked_reference(reference: IntArray, count: int) -> IntArray:
    indices = np.unique(np.asarray(reference, dtype=np.int64))
    if len(indices) < 3 or indices[0] < 0 or indices[-1] >= count:
        raise InputError(
            "estimate_two_view", "reference", list(reference), f"three or more of 0 … {count - 1}"
        )
    return indices


def _degenerate(
    points_px: FloatArray, points_star_px: FloatArray, noise_px: float
) -> TwoViewFailure | None:
    count, tolerance = len(points_px), max(2.0 * noise_px, 1e-6)
    if count < 4:
        return TwoViewFailure(
            TwoViewProblem.TOO_FEW,
            f"{count} matches; a flat object takes four, any other eight",
        )
    for name, points in (("current", points_px), ("desired", points_star_px)):
        distinct = distinct_count(points, tolerance)
        if distinct < 4:
            return TwoViewFailure(
                TwoViewProblem.COINCIDENT,
                f"only {distinct} of {count} points differ by more than {tolerance:.2g} px "
                f"in the {name} view",
            )
        if fewest_off_a_line(points, tolerance) < 2:
            return TwoViewFailure(
                TwoViewProblem.COLLINEAR,
                f"all but one of the points lie on a line in the {name} view",
            )
    return None


def _simplest_fit(views: _Views) -> _Fit | None:
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


def _robust_inliers(views: _Views) -> BoolArray:
    gate = GATE**2 * views.variance
    # The mean of both directions of transfer has twice the freedom of one Sampson distance.
    plane = find_inliers(False, views.m_star, views.m, 1.5 * gate)
    if len(views) < 9:
        return plane
    general = find_inliers(True, views.m_star, views.m, gate)
    return general if general.sum() >= max(8, plane.sum() + 3) else plane


def _spread(values: FloatArray, inliers: BoolArray) -> FloatArray:
    """Return values of the inliers at their places among all matches, NaN elsewhere."""
    result = np.full((len(inliers), *values.shape[1:]), np.nan)
    result[inliers] = values
    return result


def _rms_px(fit: _Fit, noise_px: float) -> float:
    return float(noise_px * np.sqrt(fit.chi_square / fit.residuals.size))


def _planar_result(
    fit: _Fit, inliers: BoolArray, hint: FloatArray, noise_px: float
) -> TwoView | TwoViewFailure:
    state = fit.state
    H = state.R + np.outer(state.t, state.n)
    H = H / np.linalg.svd(H)[1][1]
    motions = zip(*decompose_homography(H), strict=True)
    results = [_planar_motion(fit, inliers, noise_px, *motion) for motion in motions]
    possible = sorted(
        (result for result in results if result is not None),
        key=lambda result: -float(result.normal @ hint),
    )
    if not possible:
        return TwoViewFailure(
            TwoViewProblem.WRONG_MATCHES,
            "the only flat object that explains the matches lies behind a camera",
        )
    best = possible[0]
    if len(possible) == 2 and not np.allclose(best.upsilon, possible[1].upsilon, atol=1e-6):
        object.__setattr__(best, "alternative", possible[1])
    return best


def _planar_motion(
    fit: _Fit, inliers: BoolArray, noise_px: float, R: FloatArray, t: FloatArray, n: FloatArray
) -> TwoView | None:
    rays = homogeneous(fit.state.x_star)
    inverse_rho_star = rays @ n
    depth = rays @ R[2] + inverse_rho_star * t[2]
    if inverse_rho_star.min() <= 0.0 or depth.min() <= 0.0:
        return None
    state = fit.state._replace(R=R, t=t, n=n)
    blocks = bundle.normal_blocks(PLANE, state, fit.residuals, fit.views.weight)
    covariance = upsilon_covariance(PLANE, state, blocks, np.zeros(0, dtype=np.int64))
    return TwoView(
        rotation=R.T.copy(),
        translation=-R.T @ t,
        normal=n,
        m_star=_spread(fit.state.x_star, inliers),
        rho_star=_spread(1.0 / inverse_rho_star, inliers),
        rho=_spread(depth / inverse_rho_star, inliers),
        delta=_spread(np.zeros(len(rays)), inliers),
        covariance=covariance,
        inliers=inliers,
        planar=True,
        rms_px=_rms_px(fit, noise_px),
    )


def _general_result(
    fit: _Fit, inliers: BoolArray, reference: IntArray | None, noise_px: float
) -> TwoView | TwoViewFailure:
    state, views = fit.state, fit.views
    if reference is None:
        chosen = widest_triples(views.m_star, views.m, 1)[0]
    else:
        chosen = (np.cumsum(inliers) - 1)[reference[inliers[reference]]]
        if len(chosen) < 3:
            return TwoViewFailure(
                TwoViewProblem.WRONG_MATCHES, "points of the reference plane are wrong matches"
            )
    N = reference_plane(points_in_desired(state, chosen))
    inverse_distance = float(np.linalg.norm(N))
    blocks = bundle.normal_blocks(GENERAL, state, fit.residuals, views.weight)
    rays = homogeneous(state.x_star)
    rho_star = inverse_distance / state.w
    depth = rays @ state.R[2] + state.w * state.t[2]
    return TwoView(
        rotation=state.R.T.copy(),
        translation=-state.R.T @ state.t * inverse_distance,
        normal=N / inverse_distance,
        m_star=_spread(state.x_star, inliers),
        rho_star=_spread(rho_star, inliers),
        rho=_spread(rho_star * depth, inliers),
        delta=_spread(rays @ N / inverse_distance - 1.0 / rho_star, inliers),
        covariance=upsilon_covariance(GENERAL, state, blocks, chosen),
        inliers=inliers,
        planar=False,
        rms_px=_rms_px(fit, noise_px),
    )
