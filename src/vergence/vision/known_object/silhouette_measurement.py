"""What an image says about the outline of an object, and what its outline looked like."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.vision.known_object.color_model import ColorModel


class SilhouetteMeasurement(NamedTuple):
    """What an image says about the outline, in the form of points that a filter takes."""

    points: FloatArray  # (M, 3) object's frame, m
    points_px: FloatArray  # (M, 2)
    covariance_px: FloatArray  # (M, 2, 2) small across the outline, large along it, px²
    T_camera_target: FloatArray  # (4, 4) the pose that fits this image
    expected: int  # lines across the outline that can be read
    found: int  # of them, where the colours change at the fitted outline
    usual: float  # the same as a share
    contradicted: int  # lines with the object's colours inside, but no contour at the outline
    samples_px: FloatArray  # (N, 2) the places on the outline
    samples_found: BoolArray  # (N,)
    colors: ColorModel  # of this image, along the lines found
    unseen: FloatArray  # (6, K) motions (δp, δθ) that do not show, the turns of unit length
    shared: FloatArray  # (6, 6) covariance of what all images have wrong alike, (δp, δθ)
    astray: FloatArray  # (6, 6) and of what more is wrong while a turn is unknown
    weakest: FloatArray  # (6, K) motions of the turns that show least, K = 0 … 2
    misfit_px: float  # root mean square distance of the contour from the outline
    searched: bool = False  # whether poses elsewhere were tried, none of which has less

    @property
    def share(self) -> float:
        """How much of what should be seen was found, 0 … 1."""
        return self.found / self.expected if self.expected else 0.0

    @property
    def uncovered(self) -> float:
        """How much was found of what nothing covers, 0 … 1."""
        return self.found / max(self.found + self.contradicted, 1)


class SilhouetteMemory(NamedTuple):
    """What an object looked like."""

    colors: ColorModel
    share: float  # of its outline that was found recently, 0 … 1
    misfit_px: float  # that no pose elsewhere reduced recently


def share_log_ratio(
    seen: SilhouetteMeasurement, other: SilhouetteMeasurement, independent: float
) -> float:
    """Return by how many nats more of the outline is found at one pose than at another.

    The log likelihood ratio of two fractions, each of its own lines, to one fraction of all.

    Args:
        seen: the measurement at the first pose.
        other: the measurement at the second.
        independent: fraction of the lines that err independently.
    """
    counts = independent * np.array([[each.found, each.expected] for each in (seen, other)])
    if not (counts[:, 1] > 0.0).all():
        return 0.0
    found, missed = counts[:, 0], counts[:, 1] - counts[:, 0]
    nats = _fraction_nats(found, missed).sum() - _fraction_nats(found.sum(), missed.sum())
    return float(np.copysign(nats, seen.share - other.share))


def _fraction_nats(found: FloatArray, missed: FloatArray) -> FloatArray:
    """Return the log likelihood of the fraction that is found, at its maximum."""
    from scipy.special import xlogy

    total = found + missed
    nats: FloatArray = xlogy(found, found / total) + xlogy(missed, missed / total)
    return nats


def nothing_found(T: FloatArray, colors: ColorModel) -> SilhouetteMeasurement:
    """Return the measurement of an image without the object."""
    none = np.zeros((0, 2))
    return SilhouetteMeasurement(
        np.zeros((0, 3)), none, np.zeros((0, 2, 2)), T, 0, 0, 0.0, 0, none,
        np.zeros(0, dtype=np.bool_), colors, np.zeros((6, 0)), np.zeros((6, 6)), np.zeros((6, 6)),
        np.zeros((6, 0)), np.inf,
    )  # fmt: skip
