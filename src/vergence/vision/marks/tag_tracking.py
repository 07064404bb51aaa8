"""Corners of AprilTag or ArUco markers as a part in a cell file."""

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.errors import Absent, InputError
from vergence.parts import knob, part
from vergence.vision.image import grey_image
from vergence.vision.marks.coded import CodedMarks, MarkerDetector
from vergence.vision.marks.one_tag import tag_among
from vergence.vision.tracks import PointTracker, Tracks, nothing_found


@part("tracker", "tags")
class TagTracking:
    """Tracks corners of markers, which are identified by their numbers."""

    dictionary: str = knob("apriltag_36h11")  # dictionary of the markers, such as aruco_4x4_50
    noise_px: float = knob(0.05, "px", above=0, upto=100)  # smallest standard deviation of a corner
    # Largest initial distance between a point and its corner.
    away_px: float = knob(10.0, "px", above=0, upto=1e4)

    def __post_init__(self) -> None:
        MarkerDetector(self.dictionary)  # raises an error that lists the known dictionaries

    def start(self, image: ImageArray, points_px: FloatArray) -> PointTracker:
        """Return the tracker of the corners nearest to points (M, 2) in the first image.

        Raises:
            InputError: if no marker has a corner near a point.
        """
        detector = MarkerDetector(self.dictionary, self.noise_px)
        grey, _ = grey_image(image)
        found = _no_marks(detector) if grey is None else detector.detect(grey)
        corners = [_next_to(found, place, self.away_px) for place in points_px]
        for place, corner in zip(points_px, corners, strict=True):
            if corner is None:
                u, v = place.round().astype(int).tolist()
                given = Absent(f"no corner of a marker within {self.away_px:g} px of ({u}, {v})")
                raise InputError("task", "tracker", given, f"markers of {self.dictionary} there")
        return _TagTracker(detector, [corner for corner in corners if corner], points_px)


class _TagTracker:
    """Finds the same corners of the same markers in each image."""

    def __init__(
        self, detector: MarkerDetector, corners: list[tuple[int, int]], points_px: FloatArray
    ) -> None:
        self._detector, self._corners = detector, corners
        self._points = np.array(points_px, dtype=np.float64)

    def track(self, image: ImageArray, predicted_px: FloatArray | None = None) -> Tracks:
        """Find the corners in a new image; markers are searched for in all of it."""
        grey, reason = grey_image(image)
        if grey is None:
            return nothing_found(self._points, reason)
        seen = self._detector.detect(grey)
        lost = nothing_found(self._points.copy(), "")
        reasons = []
        for j, (number, corner) in enumerate(self._corners):
            tag = tag_among(seen, number)
            reasons.append(tag if isinstance(tag, str) else "")
            if not isinstance(tag, str):
                lost.found[j] = True
                lost.points_px[j] = tag.corners_px[corner]
                lost.covariance_px[j] = tag.covariance_px[corner]
        self._points = lost.points_px
        return lost._replace(reasons=tuple(reasons))


def _no_marks(detector: MarkerDetector) -> CodedMarks:
    return detector.detect(np.empty((0, 0), np.uint8))


def _next_to(found: CodedMarks, place: FloatArray, away_px: float) -> tuple[int, int] | None:
    """Return number and corner of the marker whose corner is nearest to a point (2,)."""
    if not len(found.ids):
        return None
    distance = np.linalg.norm(found.corners_px - place, axis=2)
    row, corner = np.unravel_index(int(distance.argmin()), distance.shape)
    return (int(found.ids[row]), int(corner)) if distance[row, corner] <= away_px else None
