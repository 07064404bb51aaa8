"""From the light on a sensor to the delivered image: gain, noise, compression."""

import math
from typing import Any

import numpy as np

from vergence.arrays import Float32Array, ImageArray
from vergence.camera.image_file import as_jpeg
from vergence.cell.schema import CameraTable, ImagingTable

_NOISE_POOL = 256  # rows and columns by which the noise pool is larger than the image
_WHITE = 255.0
_GAINS = 0.125, 8.0  # range of the automatic exposure


class Sensor:
    """Converts light, in grey levels at unit gain, into images.

    With s the signal in grey levels after the gain g, a pixel's variance is

        g 255 / N s + g² σ²

    where N is the number of electrons of a white pixel and σ the read noise [EMVA2021].

    Args:
        shape: of its images: rows, columns, and channels if they are in colour.
        table: of the camera.
        rng: generator of the noise.
    """

    def __init__(
        self, shape: tuple[int, ...], table: CameraTable, rng: np.random.Generator
    ) -> None:
        self._imaging = table.imaging or ImagingTable()
        self._read_noise, self._period, self._rng = table.noise_grey, 1.0 / table.rate_hz, rng
        self._ideal = table.imaging is None
        self._gain = 0.0  # not set yet
        pool = (shape[0] + _NOISE_POOL, shape[1] + _NOISE_POOL, *shape[2:])
        self._pool: Any = None
        if self._ideal and self._read_noise:
            self._pool = rng.normal(0, self._read_noise, pool).astype(np.int16)
        elif not self._ideal and (self._read_noise or self._imaging.full_well_electrons):
            self._pool = rng.standard_normal(pool, np.float32)
        lens = _transmission(shape[:2], self._imaging.vignetting)
        self._lens = lens.reshape(*lens.shape, *(1 for _ in shape[2:]))

    def read(self, light: ImageArray | Float32Array, settled: bool = True) -> ImageArray:
        """Return the image (height, width), or (height, width, channels).

        Args:
            light: on the sensor, (height, width), 0 … 255.
            settled: whether the automatic exposure has had time to adapt to the scene; if not, it
                continues from the last image, one period ago.
        """
        import cv2

        if self._ideal:
            grey = light if self._pool is None else cv2.add(light, self._noise(), dtype=cv2.CV_8U)
            return np.asarray(grey, dtype=np.uint8)
        signal = np.multiply(light, self._lens, dtype=np.float32)
        gain = self._gain_for(float(signal.mean()), settled)
        signal *= np.float32(gain)
        np.minimum(signal, _WHITE, out=signal)
        if self._pool is not None:
            signal += self._deviation(signal, gain) * self._noise()
        grey = np.clip(np.rint(signal), 0, 255).astype(np.uint8)
        return self._compressed(grey)

    def _noise(self) -> Any:
        """Return a random window of one noise pool: new deviates would take longer."""
        assert self._pool is not None
        row, column = self._rng.integers(0, _NOISE_POOL, 2)
        rows, columns = (side - _NOISE_POOL for side in self._pool.shape[:2])
        return self._pool[row : row + rows, column : column + columns]

    def _deviation(self, signal: Float32Array, gain: float) -> Float32Array:
        """Return the standard deviation of each pixel, (height, width), grey levels."""
        electrons = self._imaging.full_well_electrons
        variance = np.full_like(signal, (gain * self._read_noise) ** 2)
        if electrons:
            variance += np.float32(gain * _WHITE / electrons) * signal
        return np.sqrt(variance, out=variance)

    def _gain_for(self, mean: float, settled: bool) -> float:
        """Return the gain of this image, and adapt that of the next one to the mean grey level."""
        lag = self._imaging.auto_exposure_s
        if not lag:
            return 1.0
        desired = float(np.clip(self._imaging.auto_exposure_grey / max(mean, 1e-3), *_GAINS))
        if settled or not self._gain:
            self._gain = desired
        now = self._gain
        self._gain = now * (desired / now) ** (1.0 - math.exp(-self._period / lag))
        return now

    def _compressed(self, grey: ImageArray) -> ImageArray:
        import cv2

        quality = self._imaging.jpeg_quality
        if not quality:
            return grey
        data = np.frombuffer(as_jpeg(grey, quality), np.uint8)
        return np.asarray(cv2.imdecode(data, cv2.IMREAD_UNCHANGED), dtype=np.uint8)


def _transmission(shape: tuple[int, ...], lost: float) -> Float32Array:
    """Return the fraction of light that reaches each pixel, 1 - lost (r / r_corner)²."""
    rows, columns = ((np.arange(side) - (side - 1) / 2) / max((side - 1) / 2, 1) for side in shape)
    aspect = shape[1] / shape[0]
    r2 = (rows[:, None] ** 2 + (aspect * columns[None]) ** 2) / (1.0 + aspect**2)
    return np.asarray(1.0 - lost * r2, dtype=np.float32)
