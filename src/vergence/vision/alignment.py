"""Affine alignment of a patch to a template, with gain and bias, inverse compositional.

The model is I(p + A u) = g T(u) + b, where u runs over the template's pixels relative to the
feature point. Derivatives are those of the template and are computed once; a step is then one
resampling of the image and one product ([Baker2004], the inverse compositional algorithm).
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vergence.arrays import FloatArray, ImageArray
from vergence.vision.pyramid import Patch, load_window

PATCH_PX = 24  # side of the aligned patch
AREA_PX = 48  # side of the image area in which it is searched for
FREE, RIGID = 0, 1  # whether the affine matrix may change
WEIGHT_PX = 8.0  # standard deviation of the weights
UNKNOWNS = 8  # x, y, four of the affine matrix, gain, bias
STEPS = 12
PATIENCE = 3  # steps before an alignment may be given up as hopeless
CONVERGED_PX = 0.06  # length of a step, with the form's; the error left after it is a tenth
NOISE_GREY = 16.0  # grey levels; only scales the prior on the affine matrix
FORM_DEVIATION = 0.02  # standard deviation of the affine matrix from the expected one
FORM_PRIOR = (NOISE_GREY / FORM_DEVIATION) ** 2


def _root_weights() -> Patch:
    """Square roots of Gaussian weights of the patch: its rim often belongs to something else."""
    reach = np.arange(PATCH_PX) - (PATCH_PX / 2 - 0.5)
    line = np.exp(-(reach**2) / (4 * WEIGHT_PX**2))
    return np.outer(line, line).ravel().astype(np.float32)


ROOT_WEIGHTS = _root_weights()  # (n,)


class AlignmentTemplate(NamedTuple):
    """A patch of an image with everything that an alignment to it needs."""

    jacobian: Patch  # (8, n) by x, y, a11, …, a22, gain, bias; n = 24 × 24; weighted
    inverse: FloatArray  # (2, 8, 8) inverse of JᵀJ + prior; and with a rigid affine matrix
    facts: FloatArray  # (4,) feature point minus patch centre x and y, px; mean; sum of squares
    spread: FloatArray  # (2, 2) covariance of x, y, px², for noise of one grey level


class Alignment(NamedTuple):
    """The result of an alignment."""

    x: float  # px, the feature point
    y: float  # px
    gain: float
    correlation: float  # of template and resampled image, -1 … 1
    residual: float  # grey levels, root mean square
    steps: int


class Resampling(NamedTuple):
    """Work memory of an alignment."""

    area: Patch  # (48, 48) the part of the image that is resampled
    sample: Patch  # (n,) the resampled patch minus the template's mean; weighted
    weight_x: Patch  # (24,)
    weight_y: Patch  # (24,)
    corner: NDArray[np.int32]  # (24,) flat index of the upper left of four pixels


RESAMPLING_SIZE = AREA_PX * AREA_PX + PATCH_PX * PATCH_PX + 2 * PATCH_PX


@njit(cache=True, inline="always")
def make_resampling(memory: Patch, index: NDArray[np.int32]) -> Resampling:
    """Lay the parts out in flat memory of RESAMPLING_SIZE."""
    return Resampling(
        memory[:2304].reshape(48, 48),
        memory[2304:2880],
        memory[2880:2904],
        memory[2904:2928],
        index,
    )


@njit(cache=True)
def fill_template(
    image: ImageArray, anchor_x: int, anchor_y: int, x: float, y: float, out: AlignmentTemplate
) -> None:
    """Use the patch at an anchor for the feature point (x, y) as template."""
    side = PATCH_PX
    window = np.empty((side + 2, side + 2), np.float32)
    load_window(image, anchor_x, anchor_y, window)
    offset_x, offset_y = x - (anchor_x - 0.5), y - (anchor_y - 0.5)
    mean = np.sum(window[1:-1, 1:-1].copy().reshape(side * side) * ROOT_WEIGHTS**2)
    mean /= np.sum(ROOT_WEIGHTS**2)
    half, J = np.float32(0.5), out.jacobian
    for i in range(side):
        v = np.float32(i - (side / 2 - 0.5) - offset_y)
        for j in range(side):
            u, k = np.float32(j - (side / 2 - 0.5) - offset_x), i * side + j
            root = ROOT_WEIGHTS[k]
            by_x = root * half * (window[i + 1, j + 2] - window[i + 1, j])
            by_y = root * half * (window[i + 2, j + 1] - window[i, j + 1])
            J[0, k], J[1, k] = by_x, by_y
            J[2, k], J[3, k], J[4, k], J[5, k] = by_x * u, by_x * v, by_y * u, by_y * v
            J[6, k], J[7, k] = root * (window[i + 1, j + 1] - mean), root
    squares = np.sum(J[6].astype(np.float64) ** 2)
    out.facts[0], out.facts[1], out.facts[2], out.facts[3] = offset_x, offset_y, mean, squares
    normal = J.astype(np.float64) @ J.astype(np.float64).T
    for k in range(2, 6):
        normal[k, k] += FORM_PRIOR
    for k in range(UNKNOWNS):
        normal[k, k] += 1e-3  # keeps a patch without texture invertible
    out.inverse[FREE] = np.linalg.inv(normal)
    lever = out.inverse[FREE, :2] @ (J * ROOT_WEIGHTS).astype(np.float64)
    out.spread[:] = lever @ lever.T
    for k in range(2, 6):
        normal[k, :], normal[:, k], normal[k, k] = 0.0, 0.0, 1.0
    out.inverse[RIGID] = np.linalg.inv(normal)
    for k in range(2, 6):
        out.inverse[RIGID, k, k] = 0.0


@njit(cache=True, fastmath=True)
def resample(
    x: float, y: float, A: FloatArray, template: AlignmentTemplate, work: Resampling
) -> None:
    """Sample the area bilinearly at (x, y) + A u for every template pixel u, and subtract the mean.

    The positions of a row are computed first, as vector code, then its pixels are gathered; the
    unsigned indices avoid numba's negative-index check. Outside the area, the nearest pixel inside
    is used.
    """
    first, last = -(PATCH_PX / 2 - 0.5), np.float32(AREA_PX - 1.001)
    flat = work.area.reshape(AREA_PX * AREA_PX)
    index, weight_x, weight_y = work.corner, work.weight_x, work.weight_y
    mean, one, line = np.float32(template.facts[2]), np.uint64(1), np.uint64(AREA_PX)
    zero, pitch, side = np.float32(0.0), np.int32(AREA_PX), np.uint64(PATCH_PX)
    step_x, step_y = np.float32(A[0, 0]), np.float32(A[1, 0])
    u = first - template.facts[0]
    for i in range(side):
        v = first + np.float64(i) - template.facts[1]
        start_x = np.float32(x + A[0, 0] * u + A[0, 1] * v)
        start_y = np.float32(y + A[1, 0] * u + A[1, 1] * v)
        for j in range(side):
            px = min(max(start_x + step_x * np.float32(np.int32(j)), zero), last)
            py = min(max(start_y + step_y * np.float32(np.int32(j)), zero), last)
            column, row = np.int32(px), np.int32(py)
            weight_x[j], weight_y[j] = px - np.float32(column), py - np.float32(row)
            index[j] = row * pitch + column
        for j in range(side):
            k = np.uint64(index[j])
            top = flat[k] + weight_x[j] * (flat[k + one] - flat[k])
            below = flat[k + line] + weight_x[j] * (flat[k + line + one] - flat[k + line])
            value = top + weight_y[j] * (below - top) - mean
            work.sample[i * side + j] = ROOT_WEIGHTS[i * side + j] * value


@njit(cache=True, fastmath=True)
def product(a: Patch, b: Patch) -> np.float32:
    """Inner product of two flat patches."""
    total = np.float32(0.0)
    for k in range(a.size):
        total += a[k] * b[k]
    return total


@njit(cache=True)
def align(
    x: float,
    y: float,
    A: FloatArray,
    template: AlignmentTemplate,
    form: int,
    least: float,
    work: Resampling,
) -> Alignment:
    """Align the area of the image to a template; A is updated in place, starting from the prior.

    Each step solves (JᵀJ + Λ) q = JᵀI + Λ g e, where q = (g δ, g - 0, b), Λ is the weight of the
    prior and e the deviation of A from its initial value, and composes the warp with the inverse of
    the step δ. An alignment whose correlation, if it went on growing as in its last step, would not
    reach the one required in the steps left is given up.

    Args:
        x: expected column of the feature in the area, px.
        y: expected row, px.
        A: affine matrix from template to image, (2, 2).
        template: the template.
        form: FREE, or RIGID to keep A constant.
        least: correlation required; -1 if any will do.
        work: the area, and work memory.
    """
    strayed, right, q = np.zeros(4), np.zeros(UNKNOWNS), np.zeros(UNKNOWNS)
    gain, steps, before = 1.0, 0, -1.0
    for step in range(STEPS):
        steps = step + 1
        resample(x, y, A, template, work)
        if least > -1.0:
            now, _ = agreement(template, work)
            if step >= PATIENCE and now + (STEPS - step) * (now - before) < least:
                break
            before = now
        for k in range(UNKNOWNS):
            right[k] = product(template.jacobian[k], work.sample)
        for k in range(4):
            right[2 + k] += FORM_PRIOR * gain * strayed[k]
        for k in range(UNKNOWNS):
            total = 0.0
            for m in range(UNKNOWNS):
                total += template.inverse[form, k, m] * right[m]
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
        deformed = WEIGHT_PX * WEIGHT_PX * (d11 * d11 + d12 * d12 + d21 * d21 + d22 * d22)
        if move_x * move_x + move_y * move_y + deformed < CONVERGED_PX * CONVERGED_PX:
            break
    else:
        resample(x, y, A, template, work)
    correlation, residual = agreement(template, work)
    return Alignment(x, y, gain, correlation, residual, steps)


@njit(cache=True, inline="always")
def agreement(template: AlignmentTemplate, work: Resampling) -> tuple[float, float]:
    """Return correlation, and rms residual without gain and bias, of the last resampling."""
    sample, total = work.sample, product(ROOT_WEIGHTS, ROOT_WEIGHTS)
    mean = product(ROOT_WEIGHTS, sample) / total
    own = max(product(sample, sample) - total * mean * mean, 1e-6)
    # the template's values have zero mean
    joint, other = product(template.jacobian[6], sample), max(template.facts[3], 1e-6)
    correlation = joint / np.sqrt(own * other)
    residual = np.sqrt(max(own - joint * joint / other, 0.0) / (total - UNKNOWNS))
    return float(correlation), float(residual)
