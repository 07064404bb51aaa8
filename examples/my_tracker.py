"""A tracker of your own: in a cell beside it, tracker = "my_tracker:LucasKanade" under [task].

OpenCV's optical flow stands for any tracker that finds points again from image to image.
"""

import cv2
import numpy as np

import vergence as vg
from vergence.vision import Tracks


@vg.part("tracker")
class LucasKanade:
    """Follows points by OpenCV's pyramidal optical flow, from each image to the next."""

    window_px: int = vg.knob(21, "px", least=5, upto=101)  # side of the window around a point
    noise_px: float = vg.knob(0.3, "px", above=0, upto=10)  # standard deviation of a found point

    def start(self, image: np.ndarray, points_px: np.ndarray) -> "Flow":
        """Return what follows the points (M, 2) that the first image shows."""
        return Flow(self, image, points_px)


class Flow:
    """Keeps the last image, and where the points were in it."""

    def __init__(self, settings: LucasKanade, image: np.ndarray, points_px: np.ndarray) -> None:
        self._settings, self._image = settings, image
        self._points = np.asarray(points_px, np.float32)

    def track(self, image: np.ndarray, predicted_px: np.ndarray | None = None) -> Tracks:
        """Find the points in a new image."""
        window = (self._settings.window_px,) * 2
        moved, found, _ = cv2.calcOpticalFlowPyrLK(
            self._image, image, self._points, None, winSize=window
        )
        self._image, self._points, ok = image, moved, found.ravel().astype(bool)
        covariance = np.tile(self._settings.noise_px**2 * np.eye(2), (len(ok), 1, 1))
        reasons = tuple("" if one else "no match" for one in ok)
        return Tracks(moved.reshape(-1, 2).astype(float), covariance, ok, reasons)


if __name__ == "__main__":
    run = vg.run("puma560", duration_s=0.3, task={"tracker": "my_tracker:LucasKanade"})
    print(run.outcome)
