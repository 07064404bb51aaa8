"""From matched points in two pictures to motion and structure."""

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.camera import Camera
from vergence.errors import InputError, ShapeError
from vergence.vision.two_view import bundle
from vergence.vision.two_view.bundle import GENERAL, PLANE, ROTATION
from vergence.vision.two_view.checks import distinct_count, fewest_off_a_line, widest_triples
from vergence.vision.two_view.covariance import (
    points_in_desired,
    reference_plane,
    upsilon_covariance,
)
from vergence.vision.two_view.decomposition import decompose_homography
from vergence.vision.two_view.failure import TwoViewFailure, TwoViewProblem
from vergence.vision.two_view.fit import Fit, Views, robust_inliers, simplest_fit
from vergence.vision.two_view.linear import homogeneous
from vergence.vision.two_view.result import TwoView


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
        InputError: if a point is not finite, or `reference` is not three or more of the points.
    """
    points_px = np.ascontiguousarray(points_px, dtype=np.float64)
    points_star_px = np.ascontiguousarray(points_star_px, dtype=np.float64)
    if points_px.ndim != 2 or points_px.shape[1] != 2:
        raise ShapeError("points_px", points_px.shape, (None, 2))
    if points_star_px.shape != points_px.shape:
        raise ShapeError("points_star_px", points_star_px.shape, points_px.shape)
    for name, points in (("points_px", points_px), ("points_star_px", points_star_px)):
        if not np.isfinite(points).all():
            raise InputError("estimate_two_view", name, "NaN or infinity", "finite pixels")
    if reference is not None:
        reference = _checked_reference(reference, len(points_px))
    failure = _degenerate(points_px, points_star_px, noise_px)
    if failure is not None:
        return failure
    views = Views(
        np.ascontiguousarray(camera.normalize(points_star_px)),
        np.ascontiguousarray(camera.normalize(points_px)),
        camera.focal_px / noise_px,
    )
    hint = np.array([0.0, 0.0, 1.0]) if normal_hint is None else np.asarray(normal_hint)
    inliers = np.ones(len(views), dtype=np.bool_)
    fit = simplest_fit(views)
    if fit is None:
        inliers = robust_inliers(views)
        fit = simplest_fit(views.take(inliers)) if inliers.sum() >= 5 else None
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


def _spread(values: FloatArray, inliers: BoolArray) -> FloatArray:
    """Return values of the inliers at their places among all matches, NaN elsewhere."""
    result = np.full((len(inliers), *values.shape[1:]), np.nan)
    result[inliers] = values
    return result


def _rms_px(fit: Fit, noise_px: float) -> float:
    return float(noise_px * np.sqrt(fit.chi_square / fit.residuals.size))


def _planar_result(
    fit: Fit, inliers: BoolArray, hint: FloatArray, noise_px: float
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
    fit: Fit, inliers: BoolArray, noise_px: float, R: FloatArray, t: FloatArray, n: FloatArray
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
    fit: Fit, inliers: BoolArray, reference: IntArray | None, noise_px: float
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
