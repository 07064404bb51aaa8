"""Motion and structure from matched points in two images."""

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.camera import Camera
from vergence.errors import InputError, ShapeError
from vergence.vision.two_view.checks import distinct_count, fewest_off_a_line
from vergence.vision.two_view.consensus import distinct_matches
from vergence.vision.two_view.explain import explain
from vergence.vision.two_view.failure import TwoViewFailure, TwoViewProblem
from vergence.vision.two_view.fit import Views
from vergence.vision.two_view.report import Report
from vergence.vision.two_view.result import TwoView

APART = 4.0  # standard deviations: of matches closer to each other, only one counts


def estimate_two_view(
    points_px: FloatArray,
    points_star_px: FloatArray,
    camera: Camera,
    *,
    noise_px: float = 0.5,
    reference: IntArray | None = None,
    normal_hint: FloatArray | None = None,
    flat: bool = False,
) -> TwoView | TwoViewFailure:
    """Reconstruct motion and shape of an unknown object, up to scale, from two images of it.

    Nothing need be known about the object. Wrong matches are detected and rejected; the motion must
    explain more matches than chance would; the simplest of rotation, plane and general object that
    the noise allows is selected; and if a second motion explains the matches as well, the result is
    ambiguous and contains both. An object that is not flat requires eight matches. A plane through
    few points may occur by chance, so a flat object requires about seven, or four if it is known to
    be flat.

    Args:
        points_px: the points in the current view, (N, 2), the most reliable first.
        points_star_px: the same points in the desired view, (N, 2).
        camera: that took both images.
        noise_px: standard deviation of a measured coordinate; the estimate from the matches may be
            up to four times as large.
        reference: indices of three or more points that span the reference plane; by default the
            three that are spread most. A flat object is its own reference plane.
        normal_hint: assumed normal of a flat object (desired frame, away from the camera), which
            determines the order of two possible motions; the optical axis by default.
        flat: whether the object is known to be flat.

    Returns:
        The reconstruction, or why there is none.

    Raises:
        ShapeError: if the two lists differ in shape.
        InputError: if a point is not finite, or `reference` is not three or more of the points.
    """
    points_px = np.ascontiguousarray(points_px, dtype=np.float64)
    points_star_px = np.ascontiguousarray(points_star_px, dtype=np.float64)
    _check_points(points_px, points_star_px)
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
    usable = distinct_matches(points_px, points_star_px, APART * noise_px)
    found = explain(views, usable, flat)
    if isinstance(found, TwoViewFailure):
        return found
    return Report(len(views), reference, hint, noise_px).of(found)


def _check_points(points_px: FloatArray, points_star_px: FloatArray) -> None:
    if points_px.ndim != 2 or points_px.shape[1] != 2:
        raise ShapeError("points_px", points_px.shape, (None, 2))
    if points_star_px.shape != points_px.shape:
        raise ShapeError("points_star_px", points_star_px.shape, points_px.shape)
    for name, points in (("points_px", points_px), ("points_star_px", points_star_px)):
        if not np.isfinite(points).all():
            raise InputError("estimate_two_view", name, "NaN or infinity", "finite pixels")


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
            f"{count} matches; an object known to be flat takes four, any other eight",
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
