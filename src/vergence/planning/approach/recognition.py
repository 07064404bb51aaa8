"""What an image of the arm and the photograph have in common, in metres."""

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

ROUGH_M = 0.3  # distance of the object if nothing is known: rather too near, for short first moves
UNKNOWN, ROUGH, KNOWN = 0.7, 0.3, 0.05  # deviations of its logarithm
FEWEST = 8  # points to follow
IN_PLACE_PX = 3.0
MOST = 0.7  # share of the points recognised that have to be in their places
_RIVAL = 13.8  # by how much χ² of a second motion must be larger: odds of one to a thousand
_TRACK_PX = 0.15  # what a tracked point may be off beside its stated deviation


@dataclass(frozen=True, slots=True)
class Recognition:
    """Points of the photograph that are followed, and where it may have been taken."""

    image: ImageArray  # the arm's
    points_px: FloatArray  # (M, 2) in it
    star_px: FloatArray  # (M, 2) in the photograph
    goal: ArmImage  # the photograph
    images: tuple[ArmImage, ...]  # the arm's so far, that image first
    fits: tuple[GoalFit, ...]  # where it was taken, the likeliest first; never empty
    prior: Prior
    recognised_px: FloatArray  # (N, 2) all points of the photograph that were recognised

    @property
    def fit(self) -> GoalFit:
        """The likeliest."""
        return self.fits[0]

    @property
    def certain(self) -> bool:
        """Whether no other pose of the photograph explains the images as well."""
        return len(self.fits) == 1

    def with_image(self, image: ArmImage) -> "Recognition":
        """Return this with one more image of the same points; nothing is fitted again."""
        return replace(self, images=(*self.images, image))

    def fitted(self) -> "Recognition":
        """Return this with the poses fitted to all images, without those that are refuted."""
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
        """Deviation of the scale: of the goal's place along its way, relative to that."""
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
    """Recognise the photograph in an image of the arm.

    Args:
        goal: the photograph.
        image: grey, (height, width).
        T_world_camera: pose of the camera that took it, (4, 4).
        count: points to follow.
        prior: of the depths, for all points alike: `depth_m` is (1,).
        known: what images before have told; it is tried first, and dropped where it contradicts
            these two images, as after the object was moved.
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
        return TwoViewFailure(TwoViewProblem.WRONG_MATCHES, "no pose explains the points followed")
    return Recognition(
        image, points_px, star_px, star, (first,), fits, by_depth, matches.points_star_px
    )


def length_ratio(length: KnownLength, goal: GoalImage, fit: GoalFit) -> float:
    """Return how much longer a known length is than a fit has it."""
    known = fit.points_goal
    points = goal.camera.normalize(length.points_px)
    depth = depth_between(points, known[:, :2] / known[:, 2:], known[:, 2])
    ends = np.column_stack((points, np.ones(2))) * depth[:, None]
    return length.length_m / float(np.linalg.norm(ends[1] - ends[0]))


class Confirmation(NamedTuple):
    """How much of the photograph is where it shows it, once the camera is thought to be there."""

    recognised: int  # points
    in_place: int  # of them within `IN_PLACE_PX` of where the photograph has them

    @property
    def holds(self) -> bool:
        """Whether enough is recognised, and most of it in its place."""
        return self.recognised >= FEWEST and self.in_place >= MOST * self.recognised


def confirm(goal: GoalImage, image: ImageArray) -> Confirmation:
    """Compare an image with the photograph afresh, by nothing that was tracked."""
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
    """Return tracked points as `fit_goal` takes them."""
    variance = np.trace(covariance_px, axis1=1, axis2=2) / 2.0 + _TRACK_PX**2
    return arm_image(goal.camera, T_world_camera, points_px, np.sqrt(variance), found)


def _fits(
    guesses: list[GoalGuess], star: ArmImage, first: ArmImage, prior: Prior
) -> tuple[GoalFit, ...]:
    fits = [fit_goal(guess, star, (first,), prior) for guess in guesses]
    return _possible([fit for fit in fits if fit is not None])


def _possible(fits: list[GoalFit]) -> tuple[GoalFit, ...]:
    """Return the fits that no other refutes, the likeliest first."""
    if not fits:
        return ()
    best = min(fits, key=lambda fit: fit.chi_square)
    limit = best.chi_square + _RIVAL * best.scale
    # A stable sort: what images do not tell apart stays in the order of the two-view motions.
    return (best, *(fit for fit in fits if fit is not best and fit.chi_square <= limit))


def _depths(points_star: FloatArray, known: GoalFit | None, prior: Prior) -> FloatArray:
    """Return what is believed of the points' depths at the goal, (M,), m."""
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
    """Return the motions between the images, scaled to the depths believed at the goal."""
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
