"""A known object followed through a real sequence, beside ViSP's tracker of edges and KLT points.

The sequence is the cube of `bench_known_object`, of Debian's package visp-images-data, which comes
with ViSP's own settings for it. Every image, every second and every third are followed: larger
steps are faster motion. Time is CPU time for each image, over a whole sequence, the two trackers
in turn. An image counts as held if the pose explains it, judged by neither tracker: at more than
60 % of the places along the visible edges, the steepest grey value within ±10 px lies within 2 px.
"""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from bench_known_object import CAMERA, IMAGES, PACKAGE, QUADS, SIDE, cube, real_images, start
from harness import Block, Missing, Peer, measured, row
from peer_programs import BUILT, NO_VISP, Program, program
from vergence.arrays import FloatArray, ImageArray
from vergence.estimation.object_follower import ObjectFollower
from vergence.geometry import se3, so3_exp
from vergence.vision.known_object import EdgeTracker

STEPS = (1, 2, 3)  # every how-manieth image
ORDINALS = {1: "every", 2: "every second", 3: "every third"}
PERIOD_S = 0.04
ROUNDS = 7
CORNERS = SIDE * np.array(
    [(0, 0, 0), (-1, 0, 0), (-1, 1, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 1), (-1, 1, 1), (0, 1, 1)]
)
STEP_PX, BESIDE_PX, NEAR_PX, LEAST_SLOPE, HELD_SHARE = 5.0, 10.0, 2.0, 4.0, 0.6


def visible_edges(T: FloatArray) -> tuple[FloatArray, set[tuple[int, int]]]:
    """The cube's corners in the image, (8, 2), and pairs of them that an edge joins."""
    places = CORNERS @ T[:3, :3].T + T[:3, 3]
    edges = set()
    for quad in QUADS:
        a, b, c = places[list(quad[:3])]
        if np.cross(b - a, c - a) @ a < 0.0:
            pairs = zip(quad, (*quad[1:], quad[0]), strict=True)
            edges |= {(min(pair), max(pair)) for pair in pairs}
    return CAMERA.project(places), edges


def explained_share(smooth: ImageArray, T: FloatArray) -> float:
    """The share of places along the visible edges that have the steepest grey value near them."""
    import cv2

    pixels, edges = visible_edges(T)
    away = np.arange(-BESIDE_PX, BESIDE_PX + 0.01, 0.5)
    near = total = 0
    for i, j in edges:
        length = float(np.linalg.norm(pixels[j] - pixels[i]))
        along = (pixels[j] - pixels[i]) / length
        ways = np.arange(6.0, length - 6.0, STEP_PX)
        normal = np.array([-along[1], along[0]])
        places = pixels[i] + ways[:, None, None] * along + away[:, None] * normal
        inside = ((places > 2.0) & (places < (CAMERA.width - 3, CAMERA.height - 3))).all((1, 2))
        if not inside.any():
            continue
        u, v = np.moveaxis(places[inside].astype(np.float32), 2, 0)
        grey = np.asarray(cv2.remap(smooth, u, v, cv2.INTER_LINEAR))
        slope = np.abs(grey[:, 2:] - grey[:, :-2])
        steepest = np.abs(away[1:-1][slope.argmax(axis=1)])
        near += int(((slope.max(axis=1) > LEAST_SLOPE) & (steepest < NEAR_PX)).sum())
        total += int(inside.sum())
    return near / total if total else 0.0


def held(images: Sequence[ImageArray], poses: Sequence[FloatArray]) -> int:
    """In how many images the pose explains what is seen."""
    import cv2

    pairs = zip(images, poses, strict=True)
    smooth = ((cv2.GaussianBlur(image, (0, 0), 1.0).astype(np.float32), T) for image, T in pairs)
    return sum(explained_share(image, T) > HELD_SHARE for image, T in smooth)


def followed(images: Sequence[ImageArray]) -> tuple[float, list[FloatArray]]:
    """Our CPU seconds for an image, and the poses."""
    follower = ObjectFollower(EdgeTracker(cube()), CAMERA, start(), 0.0, PERIOD_S)
    before = time.thread_time()
    steps = [follower.follow(image, PERIOD_S * k) for k, image in enumerate(images)]
    seconds = (time.thread_time() - before) / len(images)
    return seconds, [step.T_camera_target for step in steps]


def visp_program() -> Program | None:
    """ViSP's tracker on the sequence, `peers/visp_track.cpp`; None if it was not built."""
    built = BUILT / "visp_track"
    if not built.is_file():
        return None
    given = [IMAGES / name for name in ("cube.xml", "cube.cao", "cube.0.pos")]
    images = sorted((IMAGES / "cube").glob("image*.pgm"))
    return program(str(built), "serve", *map(str, (*given, *images)))


def visp_followed(visp: Program, case: str, step: int) -> tuple[float, list[FloatArray]]:
    """ViSP's CPU seconds for an image, and the poses."""
    seconds, *numbers = map(float, visp.ask(f"{case} {step}").split())
    poses = np.reshape(numbers, (-1, 6))
    return seconds, [se3(so3_exp(pose[3:].copy()), pose[:3].copy()) for pose in poses]


def visp_block(visp: Program, case: str, step: int) -> Block:
    return lambda _: visp_followed(visp, case, step)[0]


def rows_of_step(images: Sequence[ImageArray], visp: Program | None, step: int) -> list[Any]:
    """Time beside edges and KLT, time beside edges alone, and the images that each holds."""
    chosen = images[::step]
    name, ours = f"known object, {ORDINALS[step]} image", held(chosen, followed(chosen)[1])
    rows = []
    for case, words, aim in (("edges_points", "edges and KLT", 1.0), ("edges", "edges", None)):
        peer: Peer | Missing = NO_VISP
        if visp:
            peer = Peer(f"{visp.name}, {words}", visp_block(visp, case, step))
        timed = row(
            f"{name}: CPU time an image",
            lambda _: followed(chosen)[0],
            peer,
            unit="ms",
            ratio_aim=aim,
            rounds=ROUNDS,
            round_seconds=1e-6,  # one sequence a round
        )
        count = measured(f"{name}: held of {len(chosen)}", ours, "") | {"peer": timed["peer"]}
        if visp:
            theirs = held(chosen, visp_followed(visp, case, step)[1])
            count |= {"peer_value": theirs, "ratio": ours / theirs}
            count |= {"aim": "ratio at least 1", "holds": ours >= theirs}
        rows += [timed, count]
    return rows


def run() -> list[dict[str, Any]]:
    if not (IMAGES / "cube").is_dir():
        none = measured("known object, a real sequence: CPU time an image", float("nan"), "ms")
        return [none | {"peer": f"real images not installed (apt install {PACKAGE})"}]
    images, visp = list(real_images()), visp_program()
    return [each for step in STEPS for each in rows_of_step(images, visp, step)]


if __name__ == "__main__":
    from run import table

    table(run())
