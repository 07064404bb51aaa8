"""Points followed over gaps in real images, beside Lucas-Kanade checked forward and backward.

The protocol, and the reference, is that of `bench_vision.py`: Lucas-Kanade carried from image to
image, and checked at each. Where it drifts, whoever is right is counted wrong, so a little of
what is counted here is the reference's. Right is within 1.5 px of it, wrong is farther than 3 px
and than five of the stated deviations.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bench_vision import RIGHT_PX, Case, cases, checked
from footage_rows import Row, beyond, median, over_stated
from real_images import sequence
from vergence.arrays import BoolArray, FloatArray
from vergence.vision import SsdTracker

WRONG_PX = 3.0
GAPS = (1, 2, 3, 5, 7, 10)
STARTS = {"cube": range(0, 69, 3), "mire-2": range(0, 490, 10)}
MOST_WRONG = 0.06  # per cent of what is told


class Found(NamedTuple):
    """Where points are said to be."""

    places: FloatArray  # (N, 2) px
    found: BoolArray  # (N,)
    covariance: FloatArray | None = None  # (N, 2, 2) px²


def ours(case: Case) -> Found:
    tracks = SsdTracker(case.before, case.points).track(case.after)
    return Found(tracks.points_px, tracks.found, tracks.covariance_px)


def lucas_kanade(case: Case) -> Found:
    return Found(*checked(case.before, case.after, case.points))


WHO = {"vergence": ours, "OpenCV Lucas-Kanade, forward and backward": lucas_kanade}


def row(name: str, who: str, chosen: Sequence[Case]) -> Row:
    answers = [WHO[who](case) for case in chosen]
    pairs = list(zip(answers, chosen, strict=True))
    off = np.concatenate([(one.places - case.reference)[one.found] for one, case in pairs])
    errors, total = np.linalg.norm(off, axis=1), sum(len(case.points) for case in chosen)
    right, wrong, stated = errors[errors <= RIGHT_PX], errors > WRONG_PX, None
    covariances = [one.covariance[one.found] for one in answers if one.covariance is not None]
    if covariances:
        stated = over_stated(off, np.concatenate(covariances))
        wrong &= beyond(off, np.concatenate(covariances))
    return Row(
        "points", name, who, total, len(right), int(wrong.sum()), total - len(errors),
        median(right), "px", stated,
    )  # fmt: skip


def aimed(own: Row, peer: Row) -> Row:
    """Our row with its aim: at most so many wrong, and no fewer right than Lucas-Kanade."""
    few = 100.0 * own.wrong <= MOST_WRONG * (own.total - own.lost)
    aim = f"at most {MOST_WRONG} % wrong, no fewer right"
    return Row(**own.record | {"aim": aim, "holds": few and own.right >= peer.right})


def rows() -> list[Row]:
    found = []
    for name, starts in STARTS.items():
        images = sequence(name)
        all_cases = [(start, *cases(images, start, GAPS)) for start in starts]
        for k, gap in enumerate(GAPS):
            chosen = [some[1 + k] for some in all_cases if len(some) > 1 + k]
            own, peer = (row(f"{name}, gap {gap}", who, chosen) for who in WHO)
            found += [aimed(own, peer), peer]
    return found
