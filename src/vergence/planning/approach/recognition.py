"""The match between an image of the arm's camera and the photograph, in metres."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.estimation.goal_fit import (
    ArmImage,
    GoalFit,
    GoalGuess,
    Prior,
    arm_image,
    fit_goal,
    points_in,
)
from vergence.geometry import se3, se3_inverse, transform_points
from vergence.planning.approach.goal import GoalImage, KnownLength
from vergence.planning.approach.points import choose_points, depth_between
from vergence.vision.matching import compare_images
from vergence.vision.matching.compare import NOISE_PX, Compared
from vergence.vision.two_view import TwoView, TwoViewFailure, TwoViewProblem

ROUGH_M = 0.3  # assumed distance if unknown: rather too small, so that first moves are short
UNKNOWN, ROUGH, KNOWN = 0.7, 0.3, 0.05  # standard deviations of its logarithm
FEWEST = 8  # number of points to track
IN_PLACE_PX = 3.0
MOST = 0.7  # fraction of the recognised points that must be in place
_RIVAL = 13.8  # difference of χ² that excludes a second motion: odds of one to a thousand
_TRACK_PX = 0.15  # error of a tracked point in addition to its stated deviation


@dataclass(frozen=True, slots=True)
class Recognition:
    """The tracked points of the photograph, and candidates for where it was taken."""

    image: ImageArray  # of the arm's camera
    points_px: FloatArray  # (M, 2) in it
    star_px: FloatArray  # (M, 2) in the photograph
    goal: ArmImage  # the photograph
    images: tuple[ArmImage, ...]  # of the arm's camera so far, `image` first
    fits: tuple[GoalFit, ...]  # where it was taken, the most likely first; never empty
    prior: Prior
    recognised_px: FloatArray  # (N, 2) all points of the photograph that were recognised

    @property
    def fit(self) -> GoalFit:
        """The most likely fit."""
        return self.fits[0]

    @property
    def certain(self) -> bool:
        """Whether no other pose of the photograph explains the images as well."""
        return len(self.fits) == 1

    def with_image(self, image: ArmImage) -> "Recognition":
        """Return a copy with one more image of the same points, without a new fit."""
        return replace(self, images=(*self.images, image))

    def fitted(self) -> "Recognition":
        """Return a copy with the poses fitted to all images, without those that are refuted."""
        again = (
            fit_goal(
                GoalGuess(fit.T_world_goal, fit.points_world), self.goal, self.images, self.prior
            )
            for fit in self.fits
        )
        found = _possible([fit for fit in again if fit is not None])
        return replace(self, fits=found) if found else self

    @property
    def depth_deviation(self) -> float:
        """Relative deviation of the scale: of the distance to the goal."""
        T, first = self.fit.T_world_goal, self.images[0].T_world_camera
        shift = T[:3, 3] - first[:3, 3]
        length = float(np.linalg.norm(shift))
        if length < 1e-6:
            return self.prior.log_deviation
        u = shift / length
        return float(np.sqrt(u @ self.fit.covariance[:3, :3] @ u)) / length


def recognise(
    goal: GoalImage,
    image: ImageArray,
    T_world_camera: FloatArray,
    count: int,
    prior: Prior,
    known: GoalFit | None = None,
) -> Recognition | TwoViewFailure:
    """Recognise the photograph in an image of the arm's camera.

    Args:
        goal: the photograph.
        image: grey, (height, width).
        T_world_camera: pose of the camera that took it, (4, 4).
        count: number of points to track.
        prior: of the depths, the same for all points: `depth_m` is (1,).
        known: fit of earlier images; tried first, and dropped if it contradicts these two images,
            as after the object was moved.
    """
    found = compare_images(image, goal.image, goal.camera, goal.matcher, goal.described)
    if isinstance(found, TwoViewFailure):
        return found
    matches, camera = found.matches, goal.camera
    chosen = choose_points(matches.points_px, matches.points_star_px, camera, count)
    if len(chosen) < FEWEST:
        return TwoViewFailure(
            TwoViewProblem.NOT_RECOGNISED,
            f"{len(chosen)} of the points recognised are away from the border in both images, "
            f"{FEWEST} are needed",
        )
    points_px, star_px = matches.points_px[chosen], matches.points_star_px[chosen]
    everywhere, noise = np.ones(len(chosen), dtype=np.bool_), np.full(len(chosen), NOISE_PX)
    star = arm_image(camera, np.eye(4), star_px, noise, everywhere)
    first = arm_image(camera, T_world_camera, points_px, noise, everywhere)
    depth = _depths(star.points, known, prior)
    guesses = _guesses(found, chosen, T_world_camera, star.points, depth)
    if known is not None:
        here = _depths_here(guesses[0], T_world_camera)
        lasting = Prior(here, UNKNOWN, known.T_world_goal, _loosened(known.covariance))
        fits = _fits(guesses, star, first, lasting)
        alone = _fits(guesses, star, first, Prior(here, UNKNOWN))
        if fits and alone and fits[0].chi_square <= alone[0].chi_square + 3.0 * _RIVAL:
            return Recognition(
                image, points_px, star_px, star, (first,), fits, lasting, matches.points_star_px
            )
    by_depth = Prior(_depths_here(guesses[0], T_world_camera), prior.log_deviation)
    fits = _fits(guesses, star, first, by_depth)
    if not fits:
        return TwoViewFailure(TwoViewProblem.WRONG_MATCHES, "no pose explains the tracked points")
    return Recognition(
        image, points_px, star_px, star, (first,), fits, by_depth, matches.points_star_px
    )


def length_ratio(length: KnownLength, goal: GoalImage, fit: GoalFit) -> float:
    """Return the ratio of a known length to its value in a fit."""
    known = fit.points_goal
    points = goal.camera.normalize(length.points_px)
    depth = depth_between(points, known[:, :2] / known[:, 2:], known[:, 2])
    ends = np.column_stack((points, np.ones(2))) * depth[:, None]
    return length.length_m / float(np.linalg.norm(ends[1] - ends[0]))


class Confirmation(NamedTuple):
    """How much of the photograph is in place, once the camera is assumed to be at the goal."""

    recognised: int  # number of points
    in_place: int  # number of them within `IN_PLACE_PX` of their position in the photograph

    @property
    def holds(self) -> bool:
        """Whether enough points are recognised and most of them are in place."""
        return self.recognised >= FEWEST and self.in_place >= MOST * self.recognised


def confirm(goal: GoalImage, image: ImageArray) -> Confirmation:
    """Compare an image with the photograph from scratch, using no tracked points."""
    found = goal.matcher.match(goal.matcher.describe(image), goal.described)
    shift = np.linalg.norm(found.points_px - found.points_star_px, axis=1)
    return Confirmation(len(shift), int(np.count_nonzero(shift < IN_PLACE_PX)))


def tracked_image(
    goal: GoalImage,
    T_world_camera: FloatArray,
    points_px: FloatArray,
    covariance_px: FloatArray,
    found: BoolArray,
) -> ArmImage:
    """Return tracked points in the form that `fit_goal` takes."""
    variance = np.trace(covariance_px, axis1=1, axis2=2) / 2.0 + _TRACK_PX**2
    return arm_image(goal.camera, T_world_camera, points_px, np.sqrt(variance), found)


def _fits(
    guesses: list[GoalGuess], star: ArmImage, first: ArmImage, prior: Prior
) -> tuple[GoalFit, ...]:
    fits = [fit_goal(guess, star, (first,), prior) for guess in guesses]
    return _possible([fit for fit in fits if fit is not None])


def _possible(fits: list[GoalFit]) -> tuple[GoalFit, ...]:
    """Return the fits that no other refutes, the most likely first."""
    if not fits:
        return ()
    best = min(fits, key=lambda fit: fit.chi_square)
    limit = best.chi_square + _RIVAL * best.scale
    # A stable sort: equally likely fits keep the order of the two-view motions.
    return (best, *(fit for fit in fits if fit is not best and fit.chi_square <= limit))


def _depths(points_star: FloatArray, known: GoalFit | None, prior: Prior) -> FloatArray:
    """Return the prior depths of the points at the goal, (M,), m."""
    if known is None:
        assert prior.depth_m is not None
        return np.full(len(points_star), float(prior.depth_m[0]))
    seen = known.points_goal
    return depth_between(points_star, seen[:, :2] / seen[:, 2:], seen[:, 2])


def _depths_here(guess: GoalGuess, T_world_camera: FloatArray) -> FloatArray:
    return points_in(T_world_camera, guess.points_world)[:, 2]


def _guesses(
    found: Compared,
    chosen: np.ndarray,
    T_world_camera: FloatArray,
    points_star: FloatArray,
    depth: FloatArray,
) -> list[GoalGuess]:
    """Return the motions between the images, scaled to the prior depths at the goal."""
    if found.view is None:
        T = T_world_camera @ se3_inverse(se3(found.rotation.copy(), np.zeros(3)))
        rays = np.column_stack((points_star, np.ones(len(points_star))))
        return [GoalGuess(T, transform_points(T, np.ascontiguousarray(rays * depth[:, None])))]
    guesses = []
    for view in (found.view, *found.view.alternatives):
        guess = _scaled(view, chosen, T_world_camera, depth)
        if guess is not None:
            guesses.append(guess)
    return guesses


def _scaled(
    view: TwoView, chosen: np.ndarray, T_world_camera: FloatArray, depth: FloatArray
) -> GoalGuess | None:
    used = np.isfinite(view.rho_star[chosen])
    if used.sum() < FEWEST:
        return None
    distance = float(np.median(depth[used] / view.rho_star[chosen][used]))
    T = T_world_camera @ se3_inverse(view.T_star_camera(distance))
    points = view.points_star(distance)[chosen]
    points[~used] = np.median(points[used], axis=0)
    return GoalGuess(T, transform_points(T, np.ascontiguousarray(points)))


def _loosened(covariance: FloatArray) -> FloatArray:
    """Return a covariance for later images: arm and mounting are not known exactly."""
    floor = np.diag([2e-3**2] * 3 + [5e-3**2] * 3)
    loosened: FloatArray = 4.0 * covariance + floor
    return loosened
