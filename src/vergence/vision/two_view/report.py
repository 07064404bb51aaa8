"""The scaled Euclidean reconstruction from a fitted model, with its ambiguities."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.vision.two_view import bundle
from vergence.vision.two_view.bundle import GENERAL, PLANE
from vergence.vision.two_view.checks import widest_triples, width
from vergence.vision.two_view.covariance import (
    points_in_desired,
    reference_plane,
    upsilon_covariance,
)
from vergence.vision.two_view.decomposition import decompose_homography
from vergence.vision.two_view.explain import Explanation
from vergence.vision.two_view.failure import TwoViewFailure, TwoViewProblem
from vergence.vision.two_view.fit import NOISE_FROM, Fit
from vergence.vision.two_view.likelihood_optima import likelihood_of
from vergence.vision.two_view.linear import homogeneous
from vergence.vision.two_view.motion_samples import covariance_of_likely
from vergence.vision.two_view.result import TwoView
from vergence.vision.two_view.widening import DRAWS, widen_for_plane

_DEVIATIONS = 2.0  # z, which covariances are to get right
_EDGE_ON = 6.0  # deviations from a line of the points of a plane that is seen edge-on


class Report(NamedTuple):
    """The settings for reporting a reconstruction."""

    total: int  # matches
    reference: IntArray | None  # indices of points that span the reference plane
    hint: FloatArray  # (3,) assumed normal of a flat object
    noise_px: float  # stated

    def of(self, found: Explanation) -> TwoView | TwoViewFailure:
        """Return the most likely motion with its alternatives."""
        motions: list[TwoView] = []
        general = [fit for fit in found.fits if fit.model == GENERAL]
        for fit in found.fits:
            told = self._of_plane(fit, found) if fit.model == PLANE else self._of_any(fit, found)
            if isinstance(told, TwoViewFailure):
                if fit is general[0]:  # the remaining ones would hide the most likely one
                    return told
            else:
                motions += told
        if not motions:
            return TwoViewFailure(
                TwoViewProblem.WRONG_MATCHES, "the points would lie behind a camera"
            )
        return _with_doubt(motions, found.turned)

    def _of_plane(self, fit: Fit, found: Explanation) -> list[TwoView]:
        """Return the motions behind a homography, first the one whose normal is along the hint."""
        H = fit.state.R + np.outer(fit.state.t, fit.state.n)
        H = H / np.linalg.svd(H)[1][1]
        motions = zip(*decompose_homography(H), strict=True)
        scale = max(_variance(fit, found), fit.chi_square / max(fit.freedom, 1))
        results = [self._planar_motion(fit, scale, *motion) for motion in motions]
        possible = sorted(
            (result for result in results if result is not None),
            key=lambda result: -float(result.normal @ self.hint),
        )
        if len(possible) == 2 and np.allclose(possible[0].upsilon, possible[1].upsilon, atol=1e-6):
            possible = possible[:1]
        return _widened(possible, fit, scale)

    def _planar_motion(
        self, fit: Fit, scale: float, R: FloatArray, t: FloatArray, n: FloatArray
    ) -> TwoView | None:
        rays = homogeneous(fit.state.x_star)
        inverse_rho_star = rays @ n
        depth = rays @ R[2] + inverse_rho_star * t[2]
        if inverse_rho_star.min() <= 0.0 or depth.min() <= 0.0:
            return None
        if -n @ R.T @ t >= 1.0:  # the current camera would see the plane from behind
            return None
        state = fit.state._replace(R=R, t=t, n=n)
        blocks = bundle.normal_blocks(PLANE, state, fit.residuals, fit.views.weight)
        covariance = upsilon_covariance(PLANE, state, blocks, np.zeros(0, dtype=np.int64))
        return TwoView(
            rotation=R.T.copy(),
            translation=-R.T @ t,
            normal=n,
            m_star=self._spread(fit.state.x_star, fit),
            rho_star=self._spread(1.0 / inverse_rho_star, fit),
            rho=self._spread(depth / inverse_rho_star, fit),
            delta=self._spread(np.zeros(len(rays)), fit),
            covariance=scale * covariance,
            inliers=self._inliers(fit),
            planar=True,
            rms_px=self._rms_px(fit),
            noise_px=self.noise_px * float(np.sqrt(scale)),
        )

    def _of_any(self, fit: Fit, found: Explanation) -> list[TwoView] | TwoViewFailure:
        """Return the motion of an object of any shape, or why its reference plane is unknown."""
        if self.reference is None:
            chosen = widest_triples(fit.views.m_star, fit.views.m, 1)[0]
        else:
            chosen = np.flatnonzero(np.isin(fit.views.index, self.reference))
        if len(chosen) < 3:
            return TwoViewFailure(
                TwoViewProblem.WRONG_MATCHES,
                f"only {len(chosen)} points of the reference plane agree with the motion; give "
                "others",
            )
        if width(fit.state.x_star[chosen]) < _EDGE_ON * np.sqrt(found.scale) * fit.views.noise:
            return TwoViewFailure(
                TwoViewProblem.COLLINEAR,
                "the points of the reference plane lie on a line in the desired view, so its "
                "distance is unknown; give others",
            )
        motion = self._general_motion(fit, found, chosen)
        if motion is None:
            return TwoViewFailure(
                TwoViewProblem.WRONG_MATCHES,
                "the points of the reference plane lie behind a camera, or too far for the noise",
            )
        return [motion]

    def _general_motion(self, fit: Fit, found: Explanation, chosen: IntArray) -> TwoView | None:
        state = fit.state
        N = reference_plane(points_in_desired(state, chosen))
        inverse_distance = float(np.linalg.norm(N))
        rays = homogeneous(state.x_star)
        rho_star = inverse_distance / state.w
        views = found.views
        blocks = bundle.normal_blocks(GENERAL, state, fit.residuals, fit.views.weight)
        covariance = covariance_of_likely(
            _variance(fit, found) * upsilon_covariance(GENERAL, state, blocks, chosen),
            likelihood_of(views.m_star, views.m, views.noise, len(views) - len(fit.views)),
            np.ascontiguousarray(state.R),
            state.t,
            found.scale,
            found.matrices,
            fit.views.m_star[chosen],
            fit.views.m[chosen],
        )
        if covariance is None:
            return None
        return TwoView(
            rotation=state.R.T.copy(),
            translation=-state.R.T @ state.t * inverse_distance,
            normal=N / inverse_distance,
            m_star=self._spread(state.x_star, fit),
            rho_star=self._spread(rho_star, fit),
            rho=self._spread(rho_star * fit.depths, fit),
            delta=self._spread(rays @ N / inverse_distance - 1.0 / rho_star, fit),
            covariance=covariance,
            inliers=self._inliers(fit),
            planar=False,
            rms_px=self._rms_px(fit),
            noise_px=self.noise_px * float(np.sqrt(found.scale)),
        )

    def _rms_px(self, fit: Fit) -> float:
        return float(self.noise_px * np.sqrt(fit.chi_square / fit.residuals.size))

    def _inliers(self, fit: Fit) -> BoolArray:
        inliers = np.zeros(self.total, dtype=np.bool_)
        inliers[fit.views.index] = True
        return inliers

    def _spread(self, values: FloatArray, fit: Fit) -> FloatArray:
        """Return values of the inliers at their indices among all matches, NaN elsewhere."""
        result = np.full((self.total, *values.shape[1:]), np.nan)
        result[fit.views.index] = values
        return result


def _variance(fit: Fit, found: Explanation) -> float:
    """Return the variance of the noise over the stated one, for covariances.

    An estimate by ν degrees of freedom is as often too small as too large. With the factor
    (1 + (z² + 1) / (4ν))², the first term of Student's quantile over that of the normal
    distribution, z deviations are exceeded as rarely as with the true variance.
    """
    if len(found.views) < NOISE_FROM or fit.freedom < 1:
        return found.scale
    student = (1.0 + (_DEVIATIONS**2 + 1.0) / (4.0 * fit.freedom)) ** 2
    return max(found.scale, student * fit.chi_square / fit.freedom)


def _widened(motions: list[TwoView], fit: Fit, scale: float) -> list[TwoView]:
    """Make the covariances of the motions behind a homography contain those of all likely ones."""
    if not motions:
        return motions
    covariances = np.array([motion.covariance for motion in motions])
    widen_for_plane(
        covariances,
        np.array([motion.upsilon for motion in motions]),
        np.ascontiguousarray(motions[0].homography),
        fit.views.m_star,
        fit.views.m,
        scale * fit.views.noise**2,
        DRAWS,
    )
    return [
        replace(motion, covariance=covariance)
        for motion, covariance in zip(motions, covariances, strict=True)
    ]


def _with_doubt(motions: list[TwoView], turned: int) -> TwoView:
    """Return the best motion with its alternatives, and what the matches do not determine."""
    best, others, doubts = motions[0], motions[1:], []
    if others:
        apart = ", ".join(f"{best.apart_deg(other):.0f}°" for other in others)
        cure = "points off the plane, its normal" if best.planar else "more matches"
        doubts.append(
            f"{len(motions)} motions explain the matches, {apart} apart; {cure} or a third image "
            "from farther aside would distinguish them"
        )
    if turned:
        doubts.append(
            f"{turned} other matches show a turn of the camera alone: they are taken for a "
            "background"
        )
    return replace(best, alternatives=tuple(others), doubt="; ".join(doubts))
