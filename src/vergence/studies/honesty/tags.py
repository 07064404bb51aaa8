"""Tags in rendered images: sharp, out of focus, in motion, in the dark."""

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.studies.honesty.answer import UNFOUNDED, Answer, deviations_of, refused
from vergence.studies.honesty.images import turn
from vergence.vision.marks import MarkerDetector

KINDS = ("sharp", "out of focus", "in motion", "dark")
DICTIONARY, NUMBERS = "apriltag_36h11", 587
SIDE_PX, FINE = 160, 4
_CELLS = 8  # of the tag, its black border in them
_CELL = 24  # samples of the drawing
_QUIET = 2 * _CELL  # white around the tag


def try_scene(random: np.random.Generator, number: int) -> list[Answer]:
    """Find the corners of a random tag."""
    import cv2

    kind = KINDS[number % len(KINDS)]
    tag = int(random.integers(NUMBERS))
    known = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    drawing = cv2.aruco.generateImageMarker(known, tag, _CELLS * _CELL)
    framed = np.pad(np.asarray(drawing, np.uint8), _QUIET, constant_values=255)
    truth = _corners(random)
    image = _rendered(random, kind, framed, truth)
    marks = MarkerDetector(DICTIONARY).detect(image)
    name = f"tag corner: {kind}"
    rows = np.flatnonzero(marks.ids == tag)
    if not len(rows):
        wrong = [Answer(name, UNFOUNDED, 1) for _ in range(4 * len(marks.ids))]
        return wrong or [refused(name, "no marker is found")] * 4
    corners, covariance = marks.corners_px[rows[0]], marks.covariance_px[rows[0]]
    return [Answer(name, deviations_of(corners[k] - truth[k], covariance[k]), 1) for k in range(4)]


def _corners(random: np.random.Generator) -> FloatArray:
    """Return the corners (4, 2), px, of a tag that is turned and seen somewhat from aside."""
    half = random.uniform(18.0, 45.0)
    square = half * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    turned = square @ turn(random.uniform(0.0, 2.0 * np.pi)).T
    slant = turned * (1.0, random.uniform(0.75, 1.0)) + random.uniform(-2.0, 2.0, (4, 2))
    return np.asarray(slant + 0.5 * (SIDE_PX - 1) + random.uniform(-4.0, 4.0, 2))


def _rendered(
    random: np.random.Generator, kind: str, drawing: ImageArray, truth: FloatArray
) -> ImageArray:
    import cv2

    # A corner of the tag lies between two samples of the drawing, half a sample from either.
    low, high = _QUIET - 0.5, _QUIET + _CELLS * _CELL - 0.5
    inner = np.array([(low, low), (high, low), (high, high), (low, high)], np.float32)
    fine = np.asarray(FINE * (truth + 0.5) - 0.5, np.float32)
    H = cv2.getPerspectiveTransform(inner, fine)
    size = (SIDE_PX * FINE, SIDE_PX * FINE)
    ground = float(random.uniform(80.0, 200.0))
    surface = cv2.warpPerspective(
        drawing.astype(np.float32),
        H,
        size,
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=ground,
    )
    focus = {"out of focus": random.uniform(1.0, 2.5)}.get(kind, random.uniform(0.35, 0.7))
    surface = cv2.GaussianBlur(surface, (0, 0), focus * FINE)
    if kind == "in motion":
        length = int(random.uniform(2.0, 7.0) * FINE) | 1
        line = np.zeros((length, length), np.float32)
        line[length // 2] = 1.0 / length
        along = cv2.getRotationMatrix2D((length // 2, length // 2), random.uniform(0.0, 180.0), 1.0)
        smear = cv2.warpAffine(line, along, (length, length))
        surface = cv2.filter2D(surface, -1, smear / np.sum(smear))
    light = random.uniform(0.15, 0.4) if kind == "dark" else random.uniform(0.6, 0.95)
    image = light * surface.reshape(SIDE_PX, FINE, SIDE_PX, FINE).mean(axis=(1, 3))
    noisy = image + random.uniform(0.5, 3.0) * random.normal(size=image.shape)
    return np.asarray(np.clip(np.rint(noisy), 0, 255).astype(np.uint8))
