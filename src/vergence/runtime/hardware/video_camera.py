"""A camera that OpenCV can open: USB, a network stream, or a video file played in real time."""

import logging
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from threading import Event, Thread
from time import monotonic

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.errors import InputError
from vergence.runtime.hardware.device_clock import DeviceClock
from vergence.runtime.hardware.metronome import Metronome
from vergence.signals import Frame

_LOG = logging.getLogger(__name__)
_FRESH_S = 5e-4  # an image that had to be waited for this long has just arrived


class VideoCamera:
    """Captures images in a thread of its own as fast as they arrive, with their times of exposure.

    If the source stamps its images, the stamps are mapped to the run's clock by offset and drift
    (`DeviceClock`). If not, an image is stamped on arrival; one that was already waiting, because
    this thread was delayed, is stamped one period after the one before.

    When the camera is unplugged or the file ends, no more images arrive, and the loop ends the run
    as for any missing images, with the outcome image late.

    Args:
        name: the camera's name.
        source: index of a device, or a file or address.
        clock: returns the run's present time, s; used to stamp images.
        latency_s: from exposure to arrival. Measure it: every millisecond of error affects a moving
            arm.
        keep: number of images that wait to be fetched; the oldest are dropped.

    Raises:
        InputError: if OpenCV cannot open the source.
    """

    def __init__(
        self,
        name: str,
        source: int | str,
        clock: Callable[[], float],
        latency_s: float = 0.0,
        keep: int = 8,
    ) -> None:
        import cv2

        self.name = name
        self._clock, self._latency_s = clock, latency_s
        self._capture = cv2.VideoCapture(source)
        if not self._capture.isOpened():
            raise InputError(f"camera {name}", "", source, "a device, file or address OpenCV opens")
        rate_hz = self._capture.get(cv2.CAP_PROP_FPS)
        self._pace = _pace_of(source, rate_hz)
        self._stamps = _Stamps(1.0 / rate_hz if rate_hz > 0.0 else np.inf)
        self._waiting: deque[tuple[float, ImageArray]] = deque(maxlen=keep)
        self._closing = Event()
        self._thread = Thread(target=self._take, name=f"camera {name}", daemon=True)
        self._thread.start()

    @property
    def ended(self) -> bool:
        """Whether no more images will come."""
        return not self._thread.is_alive()

    def frames(self, joints_at: Callable[[float], Mapping[str, FloatArray]]) -> tuple[Frame, ...]:
        """Return the images that arrived since the last call, oldest first.

        Args:
            joints_at: returns the arms' joint positions at an exposure, such as `JointHistory.at`.
        """
        arrived = [self._waiting.popleft() for _ in range(len(self._waiting))]
        return tuple(Frame(self.name, time, image, joints_at(time)) for time, image in arrived)

    def close(self) -> None:
        """Release the camera."""
        self._closing.set()
        self._thread.join()
        self._capture.release()

    def _take(self) -> None:
        import cv2

        while not self._closing.is_set():
            if self._pace is not None:
                self._pace.wait()
            before = monotonic()
            there = self._capture.grab()
            arrival, waited_s = self._clock(), monotonic() - before
            stamp = 1e-3 * self._capture.get(cv2.CAP_PROP_POS_MSEC)
            there, raw = self._capture.retrieve() if there else (False, None)
            if not there:
                _LOG.info("camera %s: no more images", self.name)
                return
            time = self._stamps.time(stamp, arrival, fresh=waited_s > _FRESH_S)
            self._waiting.append((time - self._latency_s, _grey(np.asarray(raw))))


class _Stamps:
    """Determines when images were exposed, by their own stamps if they have any.

    Args:
        period_s: between images; infinite if unknown.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._device = DeviceClock()
        self._stamp = self._time = float("-inf")

    def time(self, stamp: float, arrival: float, fresh: bool) -> float:
        """Return the time of exposure of an image that arrived, s.

        Args:
            stamp: the source's, s; ignored if it does not advance.
            arrival: on the run's clock, s.
            fresh: whether the thread waited for the image; if not, the image may have waited.
        """
        stamped, self._stamp = stamp > self._stamp > float("-inf"), stamp
        if stamped:
            self._time = self._device.time(stamp, arrival)
        else:
            waited = not fresh and self._time > float("-inf")
            self._time = min(arrival, self._time + self._period_s) if waited else arrival
        return self._time


def _pace_of(source: int | str, rate_hz: float) -> Metronome | None:
    """Return a metronome for a file; a device or an address sets its own pace."""
    if isinstance(source, int) or not Path(source).is_file():
        return None
    return Metronome(rate_hz if rate_hz > 0.0 else 25.0)


def _grey(raw: ImageArray) -> ImageArray:
    import cv2

    return raw if raw.ndim == 2 else np.asarray(cv2.cvtColor(raw, cv2.COLOR_BGR2GRAY), np.uint8)
