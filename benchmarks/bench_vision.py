"""Five points tracked within ±32 px on 640 × 480, sub-pixel, against OpenCV's ways to do it."""

from typing import Any

import cv2
import numpy as np

from harness import Peer, calls, row
from vergence.arrays import FloatArray, ImageArray
from vergence.vision import SsdTracker, pick_features

REACH_PX = 32
TEMPLATE_PX = 16
MOTION_PX = np.array([17.3, -11.6])


def two_pictures() -> tuple[ImageArray, ImageArray]:
    """A texture with detail at every scale, and the same after a motion."""
    rng = np.random.default_rng(1)
    texture = np.zeros((480, 640))
    for scale in (2, 8, 32):
        noise = rng.normal(size=(480 // scale, 640 // scale))
        texture += cv2.resize(noise, (640, 480), interpolation=cv2.INTER_CUBIC)
    first = cv2.normalize(texture, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)
    shift = np.array([[1.0, 0.0, MOTION_PX[0]], [0.0, 1.0, MOTION_PX[1]]])
    second = cv2.warpAffine(first, shift, (640, 480), borderMode=cv2.BORDER_REFLECT)
    return first, second.astype(np.uint8)


def five_points(image: ImageArray) -> FloatArray:
    return np.asarray(pick_features(image, 5).points_px)


def lucas_kanade(first: ImageArray, second: ImageArray, points: FloatArray) -> FloatArray:
    """`calcOpticalFlowPyrLK` as it comes; its three coarser levels reach beyond ±32 px."""
    found, _, _ = cv2.calcOpticalFlowPyrLK(first, second, points.astype(np.float32), None)
    return found


def match_templates(
    second: ImageArray, templates: list[ImageArray], points: FloatArray
) -> list[tuple[int, int]]:
    """`matchTemplate` of 16 × 16 pixels over ±32 px; it has no sub-pixel step of its own."""
    half = REACH_PX + TEMPLATE_PX // 2
    found = []
    for template, (x, y) in zip(templates, points.astype(int).tolist(), strict=True):
        window = second[y - half : y + half, x - half : x + half]
        scores = cv2.matchTemplate(window, template, cv2.TM_SQDIFF)
        found.append(cv2.minMaxLoc(scores)[2])
    return found


def check_all_find_the_motion(tracked: FloatArray, flow: FloatArray, start: FloatArray) -> None:
    """A tracker that does not find the points is not timed."""
    for name, found in (("ours", tracked), ("calcOpticalFlowPyrLK", flow)):
        error = np.abs(found - start - MOTION_PX).max()
        if not error < 0.5:
            raise RuntimeError(f"{name} is {error:.2f} px off")


def run() -> list[dict[str, Any]]:
    first, second = two_pictures()
    points = five_points(first)
    half = TEMPLATE_PX // 2
    templates = [
        first[y - half : y + half, x - half : x + half] for x, y in points.astype(int).tolist()
    ]
    tracker = SsdTracker(first, points)
    check_all_find_the_motion(
        tracker.track(second, points).points_px, lucas_kanade(first, second, points), points
    )
    ours = calls(lambda: tracker.track(second, points))
    version = f"OpenCV {cv2.__version__}"
    flow = Peer(
        f"{version} calcOpticalFlowPyrLK", calls(lambda: lucas_kanade(first, second, points))
    )
    match = Peer(
        f"{version} matchTemplate", calls(lambda: match_templates(second, templates, points))
    )
    name = "vision: five points, ±32 px, sub-pixel"
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        return [
            row(f"{name}, one core", ours, flow, ratio_aim=0.25),
            row(f"{name}, one core", ours, match, ratio_aim=0.25),
            several_cores(f"{name}, OpenCV on {threads} threads", ours, flow, threads),
        ]
    finally:
        cv2.setNumThreads(threads)


def several_cores(name: str, ours: Any, peer: Peer, threads: int) -> dict[str, Any]:
    cv2.setNumThreads(threads)
    return row(name, ours, peer, one_core=False)
