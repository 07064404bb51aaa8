"""How far a camera is from where a photograph was taken, by the grey values of whole images."""

from itertools import takewhile
from typing import NamedTuple, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from vergence.arrays import BoolArray, Float32Array, FloatArray, ImageArray
from vergence.camera import Camera
from vergence.estimation.displacement import Displacement
from vergence.features import Luminance
from vergence.features.luminance import coarsest_level
from vergence.geometry import se3_exp

_COARSEST = 3  # level of the pyramid
_MOST_PIXELS = 20_000  # of a level, all over it: a part of them may be hidden
_FEWEST_PIXELS = 500  # likewise, with which it is used
_ITERATIONS = 3
_DOUBTFUL = 3.0  # standard deviations from which a pixel counts less and less
_WHITE, _BLACK = 252, 2  # grey values beyond which a pixel may be clipped
# Variance of a mean of halved pixels over that of as many independent ones: (1 + 2 · 0.41)².
_CORRELATED = 3.4
_NORMAL = 1.4826  # standard deviation of normal noise over its median size


class LuminanceFit(NamedTuple):
    """What the grey values of an image say."""

    displacement: Displacement  # of the camera; `agrees` (N,) are pixels
    light: float  # contrast of the image over that of the photograph
    unlike: float  # spread of what stays unexplained over that of the photograph, without noise
    difference: float  # median difference from the photograph in the same light, grey values
    grey: Float32Array  # (N,) values of the pixels


class LuminanceGoal:
    """A photograph as the goal of photometric servoing [Collewet2011], coarse to fine.

    Near the goal, an image is I = g (I* + L ξ) + b: the photograph I* in another light, moved as
    the camera is, T_goal_camera = exp(ξ). Pixels that something hides count little, and clipped
    ones not at all.

    Args:
        image: the photograph, grey, (height, width).
        camera: that took it.
        depth_m: of what it shows, (height, width).
        mask: where it shows something, (height, width); everywhere if None.
    """

    def __init__(
        self,
        image: ImageArray,
        camera: Camera,
        depth_m: FloatArray,
        mask: BoolArray | None = None,
    ) -> None:
        self._camera = camera
        shown = np.ones(image.shape, dtype=np.bool_) if mask is None else mask
        levels = (
            _Level.of(image, shown, Luminance(image, camera, depth_m, level))
            for level in range(min(_COARSEST, coarsest_level(image.shape)) + 1)
        )
        self._levels = tuple(takewhile(lambda level: len(level.pixels) >= _FEWEST_PIXELS, levels))

    @property
    def coarsest(self) -> int:
        """The coarsest level on which enough of the photograph is left, or 0."""
        return max(len(self._levels) - 1, 0)

    def fit(
        self, image: ImageArray, level: int = 0, last: LuminanceFit | None = None
    ) -> LuminanceFit | None:
        """Return what an image says on a level of the pyramid; None if there is no texture.

        It holds for a displacement of about a pixel of that level.

        Args:
            image: grey, (height, width).
            level: 0 for the image itself.
            last: of an image of the same level that was taken from the same place: the two tell how
                much is noise.
        """
        if not self._levels:
            return None
        goal = self._levels[level]
        now = Luminance(image, self._camera, level=level).value()[goal.pixels].astype(np.float32)
        usable = (_clipped(image, self._camera, level)[goal.pixels] == 0.0).astype(np.float32)
        difference, rest = now - goal.grey, usable * _in_light(now, goal.grey)
        for _ in range(_ITERATIONS):
            scale = max(_NORMAL * float(np.median(np.abs(rest))), 1e-3)
            weight = usable / np.square(1.0 + np.square(rest / (_DOUBTFUL * scale)))
            p, H = _solved(goal.columns, difference, weight)
            rest = usable * (difference - goal.columns @ p.astype(np.float32))
        if not np.isfinite(p).all() or np.linalg.cond(H) > 1e12:
            return None
        light = goal.columns[:, 6:]
        in_light = usable * (difference - light @ _solved(light, difference, weight)[0])
        p = p / goal.size
        gain = 1.0 + float(p[6])
        if not gain > 0.0:
            return None
        covariance = np.linalg.inv(H)[:6, :6] / np.outer(goal.size[:6], goal.size[:6])
        covariance *= (scale / gain) ** 2 * (_CORRELATED if level else 1.0)
        agrees: BoolArray = (usable > 0.0) & (np.abs(rest) < _DOUBTFUL * scale)
        # The noise of the image, and of the photograph in its light.
        noise = 0.0 if last is None or len(last.grey) != len(now) else _noise(now, last.grey)
        unlike = np.sqrt(max(scale**2 - (1.0 + gain**2) * noise**2, 0.0)) / (gain * goal.spread)
        return LuminanceFit(
            Displacement(se3_exp(p[:6] / gain), covariance, agrees),
            gain,
            float(unlike),
            float(np.median(np.abs(in_light))),
            now,
        )


class _Level(NamedTuple):
    """The photograph on one level of the pyramid."""

    pixels: NDArray[np.int64]  # (N,) that count, of those of `Luminance`
    grey: Float32Array  # (N,) of these
    columns: Float32Array  # (N, 8) by g ξ, g and b, each divided by its size
    size: FloatArray  # (8,)
    spread: float  # of the grey values

    @classmethod
    def of(cls, image: ImageArray, shown: BoolArray, goal: Luminance) -> Self:
        grey, L = goal.value(), goal.interaction()
        hidden = Luminance(np.where(shown, 0, 255), goal.camera, level=goal.level).value()
        usable = (hidden == 0.0) & (_clipped(image, goal.camera, goal.level) == 0.0)
        pixels = np.flatnonzero(usable)
        pixels = pixels[:: 1 + len(pixels) // _MOST_PIXELS]
        if len(pixels) < _FEWEST_PIXELS:
            nothing = np.empty((0, 8), dtype=np.float32)
            return cls(pixels[:0], nothing[:, 0], nothing, np.ones(8), 1.0)
        star = grey[pixels]
        columns = np.column_stack((L[pixels], star, np.ones(len(pixels))))
        size = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-9)
        spread = _NORMAL * float(np.median(np.abs(star - np.median(star))))
        return cls(
            pixels, star.astype(np.float32), (columns / size).astype(np.float32), size,
            max(spread, 1e-3),
        )  # fmt: skip


def _noise(now: Float32Array, last: Float32Array) -> float:
    """Return the standard deviation of noise in two images from the same place."""
    return _NORMAL * float(np.median(np.abs(now - last)) / np.sqrt(2.0))


def _in_light(now: Float32Array, star: Float32Array) -> Float32Array:
    """Return the difference of grey values but for a change of light, by medians."""
    middle, middle_star = np.median(now), np.median(star)
    off, off_star = now - middle, star - middle_star
    spread = np.median(np.abs(off_star))
    gain = np.float32(np.median(np.abs(off)) / max(float(spread), 1e-3))
    return np.asarray(off - gain * off_star, dtype=np.float32)


def _clipped(image: ImageArray, camera: Camera, level: int) -> FloatArray:
    """Return what clipped pixels make of those of `Luminance`, (N,): 0 where they have no part."""
    clipped = np.where((image >= _WHITE) | (image <= _BLACK), 255, 0).astype(np.uint8)
    return Luminance(np.asarray(cv2.dilate(clipped, np.ones((3, 3)))), camera, level=level).value()


def _solved(
    columns: Float32Array, values: Float32Array, weight: Float32Array
) -> tuple[FloatArray, FloatArray]:
    """Return the weighted least squares solution (k,) of columns p = values, and H (k, k)."""
    weighted = columns * weight[:, None]
    H = (weighted.T @ columns).astype(np.float64)
    p = np.linalg.lstsq(H, (weighted.T @ values).astype(np.float64), rcond=None)[0]
    return np.asarray(p, dtype=np.float64), H
