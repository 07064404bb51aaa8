"""One image of a known object in one call: search, vote, fit, and search again near the fit."""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.robot.positive_definite import invert_spd
from vergence.vision.known_object.edge_lines import blur_error, edge_points
from vergence.vision.known_object.edge_measurement import (
    EdgeGeometry,
    EdgeMeasurement,
    EdgeMemory,
    EdgeRule,
)
from vergence.vision.known_object.edge_samples import (
    LEAST_COSINE,
    EdgeSamples,
    Steps,
    chosen_samples,
    sample_edges,
    search_steps,
    without_doubles,
)
from vergence.vision.known_object.pose_evidence import PRECISE_PX, TOLERANCE_PX
from vergence.vision.known_object.pose_fit import PoseFit, agreeing, fit_pose, shifted
from vergence.vision.known_object.projection import pixel_rows
from vergence.vision.known_object.shift_vote import vote_shift

_FINE_REACH_PX = 5
_DOUBLE_PX = 5.0  # edges closer than this are not distinguished
_APART_PX = 2.0  # more than the width of their steps
_NARROW_PX = 0.6  # tolerance of the last fit to sharp edges
_LEARNED_PX = 1.0
_RATE_GAIN = 0.1  # weight of one image: averages over ten
_REMEMBERED = 0.85  # weight of the old in the remembered appearance of an edge


@njit(cache=True)
def measure_edges(
    image: ImageArray,
    lens: FloatArray,
    T: FloatArray,
    covariance: FloatArray,
    geometry: EdgeGeometry,
    rule: EdgeRule,
    memory: EdgeMemory,
) -> EdgeMeasurement:
    """Find the edges near their predictions; see `EdgeTracker`.

    Args:
        image: grey, (height, width).
        lens: packed camera, (11,).
        T: predicted pose of the object in the camera, (4, 4).
        covariance: of its error (δp, δθ) along camera axes, (6, 6).
        geometry: of the object.
        rule: settings of the search.
        memory: appearance of the edges.
    """
    prior, _ = invert_spd(covariance)
    samples = _seen_samples(T, lens, geometry, _DOUBLE_PX)
    samples = chosen_samples(samples, samples.place % 2 == 0)  # half of them suffice for the vote
    reach = _reach(T, lens, samples, covariance, rule)
    steps = _search(image, samples, reach, rule, memory)
    x, y = vote_shift(samples, steps, reach)
    start = shifted(T, lens, x, y)
    fit = fit_pose(start, T, prior, lens, samples, steps, 3.0, 1.0, 6)
    width = _width(fit, steps)
    blur = np.hypot(1.0, blur_error(width) / PRECISE_PX)  # 1 in a sharp image
    apart = max(_DOUBLE_PX, width + _APART_PX)  # closer edges are blurred into one
    samples = _seen_samples(fit.T, lens, geometry, apart)
    steps = _search(image, samples, int(_FINE_REACH_PX * blur), rule, memory)
    narrowest, widest = _NARROW_PX * blur, max(TOLERANCE_PX, _NARROW_PX * blur)
    fit = fit_pose(fit.T, T, prior, lens, samples, steps, widest, narrowest, 5)
    found = agreeing(fit, steps, rule.likeness, TOLERANCE_PX * blur)
    expected, count = int(np.count_nonzero(steps.readable)), int(np.count_nonzero(found))
    # Those that blur displaces farther are the object's, but say less of where it is.
    used = agreeing(fit, steps, rule.likeness, TOLERANCE_PX)
    points, places, covariances = edge_points(fit, lens, samples, steps, used, rule.bias_px)
    return EdgeMeasurement(
        points,
        places,
        # The less of the object is found, the more likely some of it is something else.
        covariances * (expected / max(count, 1)) ** 4,
        fit.T,
        expected,
        count,
        _usual(memory, samples, steps.readable, found),
        samples.points_px,
        found,
        fit,
        samples,
        steps,
        blur,
    )


@njit(cache=True)
def learn_edges(memory: EdgeMemory, seen: EdgeMeasurement) -> EdgeMemory:
    """Return the memory after an accepted image; see `EdgeTracker.remember`."""
    templates, known, rate = memory.templates.copy(), memory.known.copy(), memory.rate.copy()
    for n in range(len(seen.samples.edge)):
        e, k, j = seen.samples.edge[n], seen.samples.place[n], seen.fit.chosen[n]
        if seen.steps.readable[n]:
            rate[e, k] += _RATE_GAIN * (seen.samples_found[n] - rate[e, k])
        if j < 0 or abs(seen.fit.residuals[n]) > _LEARNED_PX:
            continue
        share = _REMEMBERED if known[e, k] else 0.0
        mixed = share * templates[e, k] + (1.0 - share) * seen.steps.looks[n, j]
        templates[e, k] = mixed / max(np.sqrt(np.sum(mixed * mixed)), 1e-12)
        known[e, k] = True
    return EdgeMemory(templates, known, rate)


@njit(cache=True)
def _seen_samples(
    T: FloatArray, lens: FloatArray, geometry: EdgeGeometry, apart_px: float
) -> EdgeSamples:
    samples = sample_edges(
        T, lens, geometry.edges, geometry.normals, geometry.surface, geometry.places, LEAST_COSINE
    )
    return without_doubles(T, samples, geometry.normals, apart_px)


@njit(cache=True)
def _search(
    image: ImageArray, samples: EdgeSamples, reach: int, rule: EdgeRule, memory: EdgeMemory
) -> Steps:
    return search_steps(
        image, samples, reach, rule.contrast, rule.candidates, memory.templates, memory.known
    )


@njit(cache=True)
def _reach(
    T: FloatArray, lens: FloatArray, samples: EdgeSamples, covariance: FloatArray, rule: EdgeRule
) -> int:
    """Return three standard deviations of the edges' predicted positions, px, within bounds."""
    rows, widest = np.empty((2, 6)), 0.0
    for n in range(0, len(samples.edge), 5):
        pixel_rows(T, lens, samples.points[n], rows)
        across = samples.normals[n, 0] * rows[0] + samples.normals[n, 1] * rows[1]
        widest = max(widest, across @ covariance @ across)
    reach_px = 3.0 * np.sqrt(widest) + 3.0
    return int(min(max(reach_px, rule.least_reach_px), rule.most_reach_px))


@njit(cache=True)
def _width(fit: PoseFit, steps: Steps) -> float:
    """Return the width of the edges' steps, px."""
    widths = np.empty(len(fit.chosen))
    count = 0
    for n in range(len(widths)):
        if fit.chosen[n] >= 0:
            widths[count] = steps.widths[n, fit.chosen[n]]
            count += 1
    return np.median(widths[:count]) if count else 0.0


@njit(cache=True)
def _usual(
    memory: EdgeMemory, samples: EdgeSamples, readable: BoolArray, found: BoolArray
) -> float:
    """Return the fraction of places found, each weighted by how often it was found recently.

    Some edges of an object are never visible, for lack of contrast, and have no weight.
    """
    total, seen = 0.0, 0.0
    for n in range(len(found)):
        weight = memory.rate[samples.edge[n], samples.place[n]] if readable[n] else 0.0
        total += weight
        seen += weight if found[n] else 0.0
    return seen / total if total > 0.0 else 0.0
