"""The SSD pyramid tracker."""

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import FloatArray, ImageArray, frozen
from vergence.signals import SearchWindows
from vergence.vision.image import grey_image
from vergence.vision.key_templates import start_points
from vergence.vision.settled_place import FIT_PX, LOST_CORRELATION, LOST_SHIFT_PX, LOST_STRETCH
from vergence.vision.ssd_surface import RANGE_PX
from vergence.vision.track_points import track_points
from vergence.vision.tracker_state import (
    ALONE,
    AT_BORDER,
    COLUMNS,
    CONTRAST,
    CORRELATION,
    COVARIANCE,
    DEFORMED,
    DETAIL,
    DISAGREES,
    FOUND,
    LEFT,
    NO_MATCH,
    NO_TEMPLATE,
    PLACE,
    RESIDUAL,
    VERDICT,
    empty_state,
)
from vergence.vision.tracks import Tracks, nothing_found

_REASONS = {
    FOUND: "",
    LEFT: "left the image",
    AT_BORDER: "left the image: no match {:.0f} px from its border",
    NO_MATCH: f"no match: correlation {{:.2f}}, below {LOST_CORRELATION}",
    ALONE: "no match: correlation {:.2f}, and the surroundings differ",
    DISAGREES: f"no match: alignment {{:.1f}} px from the search, above {LOST_SHIFT_PX}",
    DEFORMED: f"no match: stretched by {{:.2f}} since the last image, above {LOST_STRETCH}",
    CONTRAST: "no match: contrast changed to {:.2f} of the template's",
    NO_TEMPLATE: f"no template: less than {FIT_PX:.0f} px from the border of the first image",
}


class SsdTracker:
    """Tracks image points by the pyramid search of [Nelson1995] section 2.3 and an alignment.

    Each point is searched for within ±32 px of its expected position, at three resolutions of a
    window of the image; then a patch around it is aligned, affinely and with gain and bias, to a
    key template, which gives its position to a few hundredths of a pixel. Key templates are
    replaced only when the alignment measures a stretch of more than 1.2, so drift does not
    accumulate with the number of images. A lost point is searched for again with its previous
    templates.

    Example:
        >>> tracker = SsdTracker(first_image, points_px)
        >>> tracks = tracker.track(next_image)
        >>> tracks.points_px[tracks.found]

    Attributes:
        points_px: where the points were last found, (M, 2).
    """

    def __init__(self, image: ImageArray, points_px: ArrayLike) -> None:
        """Create the templates.

        Args:
            image: the first image, grey, (height, width). If it is unusable there are no templates,
                and the points are lost for that reason in every image.
            points_px: the points in it, (M, 2), at sub-pixel positions.

        Raises:
            ShapeError: if points_px is not (M, 2).
        """
        start = frozen(points_px, (None, 2), "points_px")
        count = len(start)
        self._state = empty_state(count)
        self._state.places[:, :2] = start
        grey, reason = grey_image(image)
        self._no_template = f"no template: first {reason}" if reason else _REASONS[NO_TEMPLATE]
        if grey is not None and np.isfinite(start).all():
            start_points(grey, self._state)

    @property
    def points_px(self) -> FloatArray:
        """Last positions at which the points were found, (M, 2)."""
        return self._state.places[:, :2].copy()

    def track(self, image: ImageArray, predicted_px: FloatArray | None = None) -> Tracks:
        """Find the points in a new image.

        Args:
            image: grey, (height, width).
            predicted_px: expected positions, (M, 2); None, or a row that is not finite, for the
                last position of the point.

        Returns:
            Positions with covariances; a point that was not found has its expected position and a
            reason.

        Raises:
            ShapeError: if predicted_px is not (M, 2).
        """
        places = self._state.places
        out = np.empty((len(places), COLUMNS))
        out[:, :2] = places[:, :2]
        if predicted_px is not None:
            predicted = frozen(predicted_px, (len(places), 2), "predicted_px")
            usable = np.isfinite(predicted).all(axis=1)
            out[usable, :2] = predicted[usable]
        grey, reason = grey_image(image)
        if grey is None:
            return nothing_found(out[:, :2], reason)
        windows = SearchWindows(out[:, :2].copy(), np.full((len(out), 2), float(RANGE_PX)))
        if track_points(grey, self._state, out):
            reasons: tuple[str, ...] = ("",) * len(out)
        else:
            verdicts = zip(out[:, VERDICT].tolist(), out[:, DETAIL].tolist(), strict=True)
            reasons = tuple(self._reason(int(verdict), detail) for verdict, detail in verdicts)
        return Tracks(
            out[:, PLACE],
            out[:, COVARIANCE].reshape(-1, 2, 2),
            out[:, VERDICT] == FOUND,
            reasons,
            out[:, RESIDUAL],
            out[:, CORRELATION],
            windows,
        )

    def _reason(self, verdict: int, detail: float) -> str:
        if verdict == NO_TEMPLATE:
            return self._no_template
        return _REASONS[verdict].format(detail)
