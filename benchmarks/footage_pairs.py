"""The motion between two real images: right, wrong, or refused.

- **Nothing in common**: images of ten different things in pairs. Any motion is wrong.
- **The board**: four photographs of the calibration board in pairs. The truth is that of a
  calibration from its circles, lens and poses together.
- **The cube**: matches on the cube alone, which moves before a table at rest, over gaps of 5, 10
  and 20 images. The truth is the pose reference of `footage_objects.py`.

A motion is right if its rotation, or that of one of its alternatives, is within 5° of the truth. It
is wrong if none is, nor within five of its stated deviations. OpenCV's five-point method, which
states none, gets the same matches, and refuses where fewer than 12 agree.
"""

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from footage_boards import BOARD
from footage_objects import reference
from footage_rows import Row, beyond, median
from real_images import CUBE, IMAGES, read_grey
from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.camera import Camera
from vergence.geometry import so3_exp, so3_log
from vergence.vision.known_object import ObjectModel
from vergence.vision.matching import Compared, Sift, compare_images, match_features
from vergence.vision.matching.compare import FEWEST, NOISE_PX
from vergence.vision.two_view import TwoView, estimate_two_view

RIGHT_DEG = 5.0
THINGS = (
    "cube/image.0000.pgm", "mire-2/image.0001.pgm", "Klimt/Klimt.pgm", "calibration/grid36-01.pgm",
    "Solvay/Solvay_conference_1927_Version2_640x440.png", "AprilTag/AprilTag.pgm",
    "mbt-depth/castel/castel/image_0000.pgm", "mbt/cube/image0000.pgm", "mire/mire.pgm",
    "mbt-depth/Castle-simu/Images/Image_0001.pgm",
)  # fmt: skip
ABOUT = Camera(640, 480, focal_px=700.0)  # of cameras that nobody knows
GAPS = (5, 10, 20)


class Motion(NamedTuple):
    """One explanation of a pair."""

    rotation: FloatArray  # (3, 3) *R_c
    covariance: FloatArray | None = None  # (3, 3) of it, rad²; None if nothing is stated


class Pair(NamedTuple):
    """Two images, and how the camera turned between them."""

    current: ImageArray
    desired: ImageArray
    camera: Camera
    rotation: FloatArray | None  # (3, 3) *R_c; None if they have nothing in common
    masks: tuple[BoolArray, BoolArray] | None = None  # where to look; None for everywhere


def unrelated() -> list[Pair]:
    import cv2

    size = (ABOUT.width, ABOUT.height)
    images = [np.asarray(cv2.resize(read_grey(IMAGES / name), size), np.uint8) for name in THINGS]
    return [Pair(one, other, ABOUT, None) for one, other in combinations(images, 2)]


def of_board() -> list[Pair]:
    import cv2

    images = [read_grey(path) for path in sorted((IMAGES / "calibration").glob("grid36-*.pgm"))]
    seen = [BOARD.find(image, "") for image in images]
    points = [one.points.astype(np.float32) for one in seen if one]
    pixels = [one.points_px.astype(np.float32) for one in seen if one]
    size = images[0].shape[::-1]
    flags = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3
    _, K, lens, turns, _ = cv2.calibrateCamera(points, pixels, size, None, None, flags=flags)  # type: ignore[call-overload]
    camera = Camera(*size, K[0, 0], K[1, 1], K[0, 2], K[1, 2], distortion=tuple(lens.ravel()[:5]))
    R = [so3_exp(np.ravel(turn).copy()) for turn in turns]
    return [Pair(images[a], images[b], camera, R[b] @ R[a].T) for a, b in combinations(range(4), 2)]


def of_cube() -> list[Pair]:
    images = CUBE.images()
    truth, model = reference(CUBE, images), CUBE.model
    pairs = []
    for gap in GAPS:
        for first in range(0, len(images) - gap, 20):
            ends = first, first + gap
            if all(truth.known[k] for k in ends):
                T, T_star = (truth.poses[k] for k in ends)
                masks = covered(T, model, CUBE.camera), covered(T_star, model, CUBE.camera)
                R = T_star[:3, :3] @ T[:3, :3].T
                pairs.append(Pair(*(images[k] for k in ends), CUBE.camera, R, masks))
    return pairs


def covered(T: FloatArray, model: ObjectModel, camera: Camera) -> BoolArray:
    """Where a convex object is in the image, (height, width)."""
    import cv2

    pixels = camera.project(model.vertices @ T[:3, :3].T + T[:3, 3])
    mask = np.zeros((camera.height, camera.width), np.uint8)
    cv2.fillConvexPoly(mask, cv2.convexHull(np.rint(pixels).astype(np.int32)), 1)
    return mask > 0


def ours(pair: Pair) -> list[Motion]:
    """The motions that explain a pair; none if it is refused."""
    if pair.masks is None:
        compared = compare_images(pair.current, pair.desired, pair.camera, Sift())
        if not isinstance(compared, Compared):
            return []
        view = compared.view
        return [Motion(compared.rotation)] if view is None else motions_of(view)
    matches = matches_of(pair)
    if len(matches[0]) < FEWEST:
        return []
    answer = estimate_two_view(*matches, pair.camera, noise_px=NOISE_PX)
    return motions_of(answer) if isinstance(answer, TwoView) else []


def motions_of(view: TwoView) -> list[Motion]:
    return [Motion(each.rotation, each.covariance[3:, 3:]) for each in (view, *view.alternatives)]


def matches_of(pair: Pair) -> tuple[FloatArray, FloatArray]:
    mask, mask_star = pair.masks or (None, None)
    found = match_features(pair.current, pair.desired, mask=mask, mask_star=mask_star)
    return found.points_px, found.points_star_px


def five_point(pair: Pair) -> list[Motion]:
    """OpenCV's essential matrix and its rotation."""
    import cv2

    rays = [pair.camera.normalize(points) for points in matches_of(pair)]
    if len(rays[0]) < FEWEST:
        return []
    E, _ = cv2.findEssentialMat(
        *rays, np.eye(3), method=cv2.RANSAC, prob=0.999, threshold=1.0 / pair.camera.fx
    )
    if E is None or E.shape != (3, 3):
        return []
    count, R, _, _ = cv2.recoverPose(E, *rays, np.eye(3))
    return [Motion(R)] if count >= FEWEST else []


def row(case: str, who: str, ask: Callable[[Pair], list[Motion]], pairs: Sequence[Pair]) -> Row:
    right: list[float] = []
    wrong = lost = 0
    for pair in pairs:
        found = ask(pair)
        off = [apart_deg(motion, pair) for motion in found]
        if off and min(off) <= RIGHT_DEG:
            right.append(min(off))
        else:
            lost += not found
            wrong += bool(found) and all(unstated(motion, pair) for motion in found)
    return Row("pairs", case, who, len(pairs), len(right), wrong, lost, median(right), "°")


def turn_off(motion: Motion, R_true: FloatArray) -> FloatArray:
    """How far a rotation is off, (3,), rad."""
    turn: FloatArray = so3_log(np.ascontiguousarray(motion.rotation @ R_true.T))
    return turn


def apart_deg(motion: Motion, pair: Pair) -> float:
    if pair.rotation is None:
        return float("inf")
    return float(np.rad2deg(np.linalg.norm(turn_off(motion, pair.rotation))))


def unstated(motion: Motion, pair: Pair) -> bool:
    """Whether the truth lies beyond what a motion states of itself."""
    if pair.rotation is None or motion.covariance is None:
        return True
    off = turn_off(motion, pair.rotation)
    return bool(beyond(off[None], motion.covariance[None])[0])


def rows() -> list[Row]:
    import cv2

    found = []
    cases = {"nothing in common": unrelated, "board": of_board, "cube": of_cube}
    for case, make in cases.items():
        pairs = make()
        cv2.setRNGSeed(0)
        own, peer = (
            row(case, who, ask, pairs)
            for who, ask in (("vergence", ours), ("OpenCV, five points", five_point))
        )
        found += [Row(**own.record | {"aim": "never wrong", "holds": own.wrong == 0}), peer]
    return found
