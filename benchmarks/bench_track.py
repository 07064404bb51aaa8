"""A known object followed through a real sequence: time beside ViSP's tracker of edges and points.

The sequence is the cube of visp-images-data, which comes with ViSP's own settings for it. Every
image, every second and every third are followed: larger steps are faster motion. Time is CPU time
for each image, over a whole sequence, the two trackers in turn. How often each is right is measured
by `make footage`.
"""

import time
from collections.abc import Sequence
from contextlib import nullcontext
from functools import partial
from typing import Any

from harness import Missing, Peer, measured, row
from peer_programs import NO_VISP
from real_images import CUBE, INSTALL, PERIOD_S
from vergence.arrays import ImageArray
from vergence.estimation.known_object.object_follower import ObjectFollower
from vergence.vision.known_object import EdgeTracker
from visp_tracker import PROGRAM, VispTracker

STEPS = (1, 2, 3)  # every how-manieth image
ORDINALS = {1: "every", 2: "every second", 3: "every third"}
ROUNDS = 7
CASES = (("edges_points", "edges and KLT", 1.0), ("edges", "edges", None))


def followed_once(images: Sequence[ImageArray], _: int) -> float:
    """Our CPU seconds for an image."""
    tracker, start = EdgeTracker(CUBE.model), CUBE.first_pose()
    follower = ObjectFollower(tracker, CUBE.camera, start, 0.0, PERIOD_S)
    before = time.thread_time()
    for k, image in enumerate(images):
        follower.follow(image, PERIOD_S * k)
    return (time.thread_time() - before) / len(images)


def visp_peer(visp: VispTracker | None, case: str, words: str, step: int) -> Peer | Missing:
    if visp is None:
        return NO_VISP
    return Peer(f"{visp.name}, {words}", lambda _: visp.follow(case, step).seconds)


def run() -> list[dict[str, Any]]:
    name = "known object, {} image: CPU time an image"
    images = CUBE.images()
    if not images:
        return [measured(name.format("every"), float("nan"), "ms") | {"peer": INSTALL}]
    rows = []
    with VispTracker(CUBE, images) if PROGRAM.is_file() else nullcontext() as visp:
        for step in STEPS:
            chosen = images[::step]
            for case, words, aim in CASES:
                rows.append(
                    row(
                        name.format(ORDINALS[step]),
                        partial(followed_once, chosen),
                        visp_peer(visp, case, words, step),
                        unit="ms",
                        ratio_aim=aim,
                        rounds=ROUNDS,
                        round_seconds=1e-6,  # one sequence a round
                    )
                )
    return rows


if __name__ == "__main__":
    from run import table

    table(run())
