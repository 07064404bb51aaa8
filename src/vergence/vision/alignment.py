"""Affine alignment of a patch to a template, with gain and bias, inverse compositional.

The model is I(p + A u) = g T(u) + b, where u runs over the template's pixels relative to the
feature point. Its derivatives stand on the template's side and are made once; a step is then one
resampling of the image and one product ([Baker2004], the inverse compositional algorithm).
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, ImageArray
from vergence.vision.pyramid import Patch, load_window

PATCH_PX = 24  # side of the patch that is aligned
AREA_PX = 64  # side of the part of the image that it is looked for in
UNKNOWNS = 8  # x, y, four of the affine matrix, gain, bias
STEPS = 12
CONVERGED_PX = 0.004
NOISE_GREY = 4.0  # grey levels; scales the prior on the affine matrix, nothing else
FORM_DEVIATION = 0.1  # how far the affine matrix strays from what is expected


class AlignmentTemplate(NamedTuple):
    """A patch of a picture and all that an alignment to it needs."""

    values: Patch  # (n,) grey levels, less their mean; n = 24 × 24
    jacobian: Patch  # (8, n) by x, y, a11, a12, a21, a22, gain, bias
    inverse: FloatArray  # (8, 8) inverse of JᵀJ + prior
    offset: FloatArray  # (2,) feature point less patch centre, px
    moments: FloatArray  # (2,) mean, and sum of squares of values


class Alignment(NamedTuple):
    """What an alignment ended with."""

    x: float  # px, the feature point
    y: float  # px
    gain: float
    correlation: float  # of template and resampled image, -1 … 1
    residual: float  # grey levels, root mean square
    steps: int


def empty_template() -> AlignmentTemplate:
    """Allocate a template."""
    n = PATCH_PX * PATCH_PX
    return AlignmentTemplate(
        np.zeros(n, np.float32),
        np.zeros((UNKNOWNS, n), np.float32),
        np.zeros((UNKNOWNS, UNKNOWNS)),
        np.zeros(2),
        np.zeros(2),
    )


@njit(cache=True)
def fill_template(
    image: ImageArray, anchor_x: int, anchor_y: int, x: float, y: float, out: AlignmentTemplate
) -> None:
    """Take the patch at an anchor for the feature point (x, y) as template."""
    side = PATCH_PX
    window = np.empty((side + 2, side + 2), np.float32)
    load_window(image, anchor_x, anchor_y, window)
    out.offset[0], out.offset[1] = x - (anchor_x - 0.5), y - (anchor_y - 0.5)
    mean = np.mean(window[1:-1, 1:-1])
    half, J = np.float32(0.5), out.jacobian
    for i in range(side):
        v = np.float32(i - (side / 2 - 0.5) - out.offset[1])
        for j in range(side):
            u, k = np.float32(j - (side / 2 - 0.5) - out.offset[0]), i * side + j
            value = window[i + 1, j + 1] - mean
            by_x = half * (window[i + 1, j + 2] - window[i + 1, j])
            by_y = half * (window[i + 2, j + 1] - window[i, j + 1])
            out.values[k] = value
            J[0, k], J[1, k] = by_x, by_y
            J[2, k], J[3, k], J[4, k], J[5, k] = by_x * u, by_x * v, by_y * u, by_y * v
            J[6, k], J[7, k] = value, 1.0
    out.moments[0] = mean
    out.moments[1] = np.sum(out.values.astype(np.float64) ** 2)
    normal = J.astype(np.float64) @ J.astype(np.float64).T
    prior = (NOISE_GREY / FORM_DEVIATION) ** 2
    for k in range(2, 6):
        normal[k, k] += prior
    for k in range(UNKNOWNS):
        normal[k, k] += 1e-3  # keeps a patch without texture invertible
    out.inverse[:] = np.linalg.inv(normal)


@njit(cache=True, fastmath=True)
def resample(
    area: Patch, x: float, y: float, A: FloatArray, offset: FloatArray, mean: float, out: Patch
) -> None:
    """Sample an area bilinearly at (x, y) + A u for every template pixel u; less a mean."""
    side, last = PATCH_PX, area.shape[0] - 1.001
    first = -(side / 2 - 0.5)
    for i in range(side):
        v = first + i - offset[1]
        start_x = x + A[0, 1] * v + A[0, 0] * (first - offset[0])
        start_y = y + A[1, 1] * v + A[1, 0] * (first - offset[0])
        for j in range(side):
            px = min(max(start_x + A[0, 0] * j, 0.0), last)
            py = min(max(start_y + A[1, 0] * j, 0.0), last)
            column, row = np.uint64(px), np.uint64(py)
            one = np.uint64(1)
            fx, fy = np.float32(px - column), np.float32(py - row)
            top = area[row, column] + fx * (area[row, column + one] - area[row, column])
            below = area[row + one, column]
            below += fx * (area[row + one, column + one] - below)
            out[i * side + j] = top + fy * (below - top) - np.float32(mean)


@njit(cache=True, fastmath=True)
def product(a: Patch, b: Patch) -> np.float32:
    """Inner product of two flat patches."""
    total = np.float32(0.0)
    for k in range(a.size):
        total += a[k] * b[k]
    return total


@njit(cache=True)
def align(
    area: Patch, x: float, y: float, A: FloatArray, template: AlignmentTemplate, sample: Patch
) -> Alignment:
    """Align an area of the image to a template; A is changed in place, its start is the prior.

    Each step solves (JᵀJ + Λ) q = JᵀI + Λ g e, where q = (g δ, g - 0, b), Λ is the weight of the
    prior and e is how far A has come from its start, and puts the inverse of the step δ before
    the warp.

    Args:
        area: part of the image, (64, 64).
        x: where the feature is expected in the area, px.
        y: likewise.
        A: affine matrix from template to image, (2, 2).
        template: what to align to.
        sample: memory for the resampled patch, (n,).
    """
    prior = (NOISE_GREY / FORM_DEVIATION) ** 2
    strayed, right, q = np.zeros(4), np.zeros(UNKNOWNS), np.zeros(UNKNOWNS)
    gain, steps = 1.0, 0
    for step in range(STEPS):
        steps = step + 1
        resample(area, x, y, A, template.offset, template.moments[0], sample)
        for k in range(UNKNOWNS):
            right[k] = product(template.jacobian[k], sample)
        for k in range(4):
            right[2 + k] += prior * gain * strayed[k]
        for k in range(UNKNOWNS):
            total = 0.0
            for m in range(UNKNOWNS):
                total += template.inverse[k, m] * right[m]
            q[k] = total
        gain = q[6]
        if not 0.05 < gain < 20.0:
            break
        dx, dy = q[0] / gain, q[1] / gain
        d11, d12, d21, d22 = q[2] / gain, q[3] / gain, q[4] / gain, q[5] / gain
        strayed[0] -= d11
        strayed[1] -= d12
        strayed[2] -= d21
        strayed[3] -= d22
        determinant = (1.0 + d11) * (1.0 + d22) - d12 * d21
        if not 0.2 < determinant < 5.0:
            gain = 0.0
            break
        # A (I + δA)⁻¹, then the point moves by - A' δt
        a11 = (A[0, 0] * (1.0 + d22) - A[0, 1] * d21) / determinant
        a12 = (A[0, 1] * (1.0 + d11) - A[0, 0] * d12) / determinant
        a21 = (A[1, 0] * (1.0 + d22) - A[1, 1] * d21) / determinant
        a22 = (A[1, 1] * (1.0 + d11) - A[1, 0] * d12) / determinant
        A[0, 0], A[0, 1], A[1, 0], A[1, 1] = a11, a12, a21, a22
        move_x, move_y = a11 * dx + a12 * dy, a21 * dx + a22 * dy
        x -= move_x
        y -= move_y
        if move_x * move_x + move_y * move_y < CONVERGED_PX * CONVERGED_PX:
            break
    correlation, residual = agreement(area, x, y, A, template, sample)
    return Alignment(x, y, gain, correlation, residual, steps)


@njit(cache=True)
def agreement(
    area: Patch, x: float, y: float, A: FloatArray, template: AlignmentTemplate, sample: Patch
) -> tuple[float, float]:
    """Correlation and root mean square residual (gain and bias taken out) of a warp."""
    resample(area, x, y, A, template.offset, template.moments[0], sample)
    n = sample.size
    mean = product(template.jacobian[7], sample) / n
    own = max(product(sample, sample) - n * mean * mean, 1e-6)
    # the template's values have no mean
    joint, other = product(template.values, sample), max(template.moments[1], 1e-6)
    correlation = joint / np.sqrt(own * other)
    residual = np.sqrt(max(own - joint * joint / other, 0.0) / (n - UNKNOWNS))
    return float(correlation), float(residual)
