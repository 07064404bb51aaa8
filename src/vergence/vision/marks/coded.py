"""AprilTag and ArUco markers, found by OpenCV."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray, IntArray
from vergence.errors import InputError
from vergence.tag_families import TAG_FAMILIES, tag_family
from vergence.vision.brightness import brightened
from vergence.vision.marks.tag_corners import refined_corners

_CELL_MARGIN = 0.3  # of a cell, next to its neighbours, that blur spoils and is not read

_BLURRED_PX = 0.13  # standard deviation of corners, from which on an image is sharpened, too
_FOCUS_PX, _STEEPER = 3.0, 4.0  # what is sharpened, and how much

DICTIONARIES = {name: family.opencv for name, family in TAG_FAMILIES.items()}


class CodedMarks(NamedTuple):
    """The markers of an image."""

    ids: IntArray  # (M,)
    corners_px: FloatArray  # (M, 4, 2) clockwise from the marker's own top left
    covariance_px: FloatArray  # (M, 4, 2, 2) px²


@dataclass(frozen=True, slots=True)
class MarkerDetector:
    """Finds the markers of one dictionary, their corners refined to a fraction of a pixel.

    How sure a corner is follows from the image: sides that are blurred or noisy tell less.
    """

    dictionary: str
    noise_px: float = 0.05  # least standard deviation of a corner; blur and noise add to it
    _detector: Any = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        import cv2

        family = tag_family(self.dictionary, "MarkerDetector")
        if not self.noise_px > 0.0:
            raise InputError("MarkerDetector", "noise_px", self.noise_px, "above zero")
        known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, family.opencv))
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        parameters.perspectiveRemoveIgnoredMarginPerCell = _CELL_MARGIN
        object.__setattr__(self, "_detector", cv2.aruco.ArucoDetector(known, parameters))

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make it again: OpenCV's detector cannot be copied."""
        return MarkerDetector, (self.dictionary, self.noise_px)

    def detect(
        self, image: ImageArray, window: tuple[int, int, int, int] | None = None
    ) -> CodedMarks:
        """Find the markers of an image, or of a window of it.

        Args:
            image: grey, (height, width).
            window: left, top, right, bottom in pixels, the last two excluded; all by default.
        """
        left, top = (max(window[0], 0), max(window[1], 0)) if window else (0, 0)
        if window is not None:
            image = image[top : max(window[3], top), left : max(window[2], left)]
        if not image.size:
            return _marks([], None, self.noise_px)
        marks = self._refined(image, self._detected(brightened(image, smooth=True)))
        widest = marks.covariance_px.max(axis=(1, 2, 3))
        if not len(marks.ids) or float(np.median(widest)) > _BLURRED_PX**2:
            marks = self._with_blurred(image, marks)
        return marks._replace(corners_px=marks.corners_px + (left, top))

    def _detected(self, image: ImageArray) -> CodedMarks:
        corners, ids, _ = self._detector.detectMarkers(np.ascontiguousarray(image))
        return _marks(corners, ids, self.noise_px)

    def _refined(self, image: ImageArray, marks: CodedMarks) -> CodedMarks:
        for k in range(len(marks.ids)):
            marks.corners_px[k], marks.covariance_px[k] = refined_corners(
                image, marks.corners_px[k], self._cells(int(marks.ids[k])), self.noise_px
            )
        return marks

    def _cells(self, number: int) -> FloatArray:
        """Return a marker with its border, a pixel a cell: 0 for black, 1 for white, (n, n)."""
        known = self._detector.getDictionary()
        drawing = known.generateImageMarker(number, known.markerSize + 2)
        return np.asarray(drawing, np.float64) / 255.0

    def _with_blurred(self, image: ImageArray, marks: CodedMarks) -> CodedMarks:
        """Return the markers, and those that are found when the image is sharpened."""
        more = self._detected(_sharpened(brightened(image, smooth=True)))
        new = ~np.isin(more.ids, marks.ids)
        if not new.any():
            return marks
        chosen = CodedMarks(more.ids[new], more.corners_px[new], more.covariance_px[new])
        added = self._refined(image, chosen)
        return CodedMarks(
            np.concatenate((marks.ids, added.ids)),
            np.concatenate((marks.corners_px, added.corners_px)),
            np.concatenate((marks.covariance_px, added.covariance_px)),
        )


def _sharpened(image: ImageArray) -> ImageArray:
    """Return an image with its edges steepened, as if it were in focus."""
    import cv2

    grey = image.astype(np.float32)
    smooth = cv2.GaussianBlur(grey, (0, 0), _FOCUS_PX)
    steep = cv2.addWeighted(grey, 1.0 + _STEEPER, smooth, -_STEEPER, 0.0)
    return np.clip(np.rint(steep), 0, 255).astype(np.uint8)


def _marks(corners: Any, ids: Any, noise_px: float) -> CodedMarks:
    places = np.array(corners, dtype=np.float64).reshape(-1, 4, 2)
    numbers = np.zeros(0) if ids is None else np.ravel(ids)
    covariance = np.tile(np.eye(2) * noise_px**2, (len(places), 4, 1, 1))
    return CodedMarks(numbers.astype(np.int64), places, covariance)
