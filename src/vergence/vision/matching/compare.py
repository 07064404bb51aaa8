"""Compares two images of a scene: the pose of the first camera relative to the second."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.camera import Camera
from vergence.vision.matching.image_faults import image_fault
from vergence.vision.matching.matcher import Matcher, Matches, finer_of
from vergence.vision.two_view import (
    TwoView,
    TwoViewFailure,
    TwoViewProblem,
    estimate_two_view,
)

NOISE_PX = 0.3  # standard deviation of a matched point
FEWEST = 12  # number of matches that must agree
_LEAST_OF_MEDIAN = 0.1  # relative depth below which a match is wrong even if it agrees
LEAST_AREA = 0.01  # fraction of both images that they must span


class Compared(NamedTuple):
    """The common part of two images."""

    matches: Matches  # those that agree on the motion
    view: TwoView | None  # the motion; None for a pure rotation of the camera
    rotation: FloatArray  # (3, 3) orientation of the current camera in the desired frame
    tried: int  # matches before wrong ones were rejected


def compare_images(
    image: ImageArray,
    image_star: ImageArray,
    camera: Camera,
    matcher: Matcher,
    described_star: Any = None,
) -> Compared | TwoViewFailure:
    """Match two images and find the motion between them, or return why none is acceptable.

    The motion must explain more matches than chance would (`estimate_two_view`), at least `FEWEST`,
    and they must span a part of both images. If the matcher finds too few, its `finer` variant is
    used. If that fails too, the desired image is examined: it may be blurred, badly exposed, or
    mirrored.

    Args:
        image: the current image, grey, (height, width).
        image_star: the desired image, grey, (height, width).
        camera: that took both.
        matcher: finds common points.
        described_star: the desired image as described by the matcher, if available.
    """
    desired = matcher.describe(image_star) if described_star is None else described_star
    found = _motion_of(matcher.match(matcher.describe(image), desired), camera)
    if isinstance(found, Compared):
        return found
    if (finer := finer_of(matcher)) is not None:
        return compare_images(image, image_star, camera, finer)
    return _explained(found, image, image_star, camera, matcher)


def _motion_of(matches: Matches, camera: Camera) -> Compared | TwoViewFailure:
    if not matches:
        return TwoViewFailure(TwoViewProblem.NOT_RECOGNISED, matches.reason)
    points = matches.points_px, matches.points_star_px
    view = estimate_two_view(*points, camera, noise_px=NOISE_PX)
    if isinstance(view, TwoViewFailure) and view.problem is TwoViewProblem.TOO_FEW:
        # With little parallax a plane explains everything; later images will show deviations from
        # it.
        view = estimate_two_view(*points, camera, noise_px=NOISE_PX, flat=True)
    if isinstance(view, TwoView):
        agree = view.inliers & _ahead(view.rho_star) & _ahead(view.rho)
        rotation = view.rotation
    elif view.problem is TwoViewProblem.NO_TRANSLATION and view.rotation is not None:
        agree, rotation = _turned(matches, camera, view.rotation), view.rotation
    else:
        return view
    chosen = Matches(matches.points_px[agree], matches.points_star_px[agree], "")
    if doubt := _too_little(chosen, camera):
        return TwoViewFailure(TwoViewProblem.NOT_RECOGNISED, doubt)
    taken = replace_matches(view, agree) if isinstance(view, TwoView) else None
    return Compared(chosen, taken, rotation, len(agree))


def _ahead(depth: FloatArray) -> BoolArray:
    """Return which points (N,) are clearly in front of the camera, unlike some wrong matches."""
    ahead: BoolArray = depth > _LEAST_OF_MEDIAN * np.nanmedian(depth)  # never true of NaN
    return ahead


def _turned(matches: Matches, camera: Camera, R: FloatArray) -> np.ndarray:
    """Return which matches a pure rotation of the camera explains, (N,)."""
    rays = np.column_stack((camera.normalize(matches.points_px), np.ones(len(matches.points_px))))
    turned = rays @ R.T
    ahead: np.ndarray = turned[:, 2] > 1e-3
    shift = np.full(len(rays), np.inf)
    expected = camera.project(turned[ahead])
    shift[ahead] = np.linalg.norm(expected - matches.points_star_px[ahead], axis=1)
    near: np.ndarray = shift < 8.0 * NOISE_PX
    return near


def replace_matches(view: TwoView, chosen: np.ndarray) -> TwoView:
    """Return a reconstruction and its alternatives, restricted to some of its matches."""
    return replace(
        view,
        m_star=view.m_star[chosen],
        rho_star=view.rho_star[chosen],
        rho=view.rho[chosen],
        delta=view.delta[chosen],
        inliers=view.inliers[chosen],
        alternatives=tuple(replace_matches(other, chosen) for other in view.alternatives),
    )


def _too_little(matches: Matches, camera: Camera) -> str:
    count = len(matches.points_px)
    if count < FEWEST:
        return f"{count} points are recognised, {FEWEST} are needed to be sure"
    area = min(_spanned(points) for points in (matches.points_px, matches.points_star_px))
    share = area / (camera.width * camera.height)
    if share < LEAST_AREA:
        return f"the points recognised span {100 * share:.1f} % of the image, too little to be sure"
    if _turned_over(matches):
        return "one image shows the points mirrored"
    return ""


def _turned_over(matches: Matches) -> bool:
    """Return whether the best affine map between the points contains a reflection."""
    now, desired = (points - points.mean(axis=0) for points in matches[:2])
    return bool(np.linalg.det(np.linalg.lstsq(now, desired, rcond=None)[0]) < 0.0)


def _spanned(points_px: FloatArray) -> float:
    """Return the area of the two-sigma ellipse of points (N, 2), px²."""
    values = np.linalg.eigvalsh(np.cov(points_px.T))
    return float(4.0 * np.pi * np.sqrt(np.prod(np.maximum(values, 0.0))))


def _explained(
    failure: TwoViewFailure,
    image: ImageArray,
    image_star: ImageArray,
    camera: Camera,
    matcher: Matcher,
) -> TwoViewFailure:
    """Return a failure with the faults of the images added to its reason."""
    for name, taken in (("goal", image_star), ("current", image)):
        if fault := image_fault(taken):
            return replace(failure, reason=f"the {name} image is {fault} ({failure.reason})")
    mirrored = np.ascontiguousarray(image_star[:, ::-1])
    matches = matcher.match(matcher.describe(image), matcher.describe(mirrored))
    if isinstance(_motion_of(matches, camera), Compared):
        return replace(failure, reason=f"the goal image is mirrored ({failure.reason})")
    reason = f"no part of the goal image is recognised with certainty ({failure.reason})"
    return replace(failure, reason=reason)
