"""Twelve AprilTags in a real photograph, spoilt by blur, motion and darkness.

The reference of a corner is the mean of what ViSP says of the photograph as it is (a file beside
it) and what we say; they differ by 0.21 px. ViSP and OpenCV's AprilTag refinement count pixels
from the corner of the first, half a pixel from our convention; that is taken off. Right is a
tag whose corners are all within 3 px.
"""

import re
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from footage_objects import INSTALL_VISP
from footage_rows import Row, median, missing
from peer_programs import BUILT, Program
from real_images import IMAGES, SPOILS, Spoil, blurred, darkened, read_grey
from vergence.arrays import FloatArray, ImageArray
from vergence.vision.marks import MarkerDetector

FOLDER = IMAGES / "AprilTag"
PROGRAM = BUILT / "visp_tags"
RIGHT_PX = 3.0
HALF_PX = 0.5
CASES: Mapping[str, Spoil] = {
    **SPOILS,
    "blurred, σ 3 px": blurred(3.0),
    "blurred, σ 4 px": blurred(4.0),
    "a tenth of the light": darkened(0.1),
}

Tags = dict[int, FloatArray]  # number: corners (4, 2), px
Detector = Callable[[ImageArray], Tags]


def package_corners() -> Tags:
    """What the package's file says: row and column of each corner."""
    numbers: dict[int, list[float]] = {}
    for word in (FOLDER / "ground_truth_detection.txt").read_text().split():
        if match := re.match(r"36h11_id:_(\d+)", word):
            corners = numbers.setdefault(int(match[1]), [])
        else:
            corners.append(float(word))
    return {tag: np.reshape(values, (4, 2))[:, ::-1] - HALF_PX for tag, values in numbers.items()}


def ours(image: ImageArray) -> Tags:
    marks = MarkerDetector("apriltag_36h11").detect(image)
    return dict(zip(marks.ids.tolist(), marks.corners_px, strict=True))


def opencv(refinement: str, shift_px: float) -> Detector:
    """OpenCV's detector with one of its refinements."""
    import cv2

    known = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    options = cv2.aruco.DetectorParameters()
    options.cornerRefinementMethod = getattr(cv2.aruco, refinement)
    detector = cv2.aruco.ArucoDetector(known, options)

    def detect(image: ImageArray) -> Tags:
        corners, ids, _ = detector.detectMarkers(image)
        found = zip(np.ravel([] if ids is None else ids).tolist(), corners, strict=True)
        return {tag: place[0] - shift_px for tag, place in found}

    return detect


def visp(image: ImageArray) -> Tags:
    """ViSP's detector, `peers/visp_tags.cpp`."""
    import cv2

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tags.pgm"
        cv2.imwrite(str(path), image)
        program = Program((str(PROGRAM), "serve"))
        rows = np.reshape([float(word) for word in program.ask(str(path)).split()[1:]], (-1, 9))
        program.end()
    return {int(row[0]): row[1:].reshape(4, 2) - HALF_PX for row in rows}


def detectors() -> dict[str, Detector]:
    found: dict[str, Detector] = {"vergence": ours}
    if PROGRAM.is_file():
        found["ViSP"] = visp
    found["OpenCV, AprilTag"] = opencv("CORNER_REFINE_APRILTAG", HALF_PX)
    found["OpenCV, sub-pixel"] = opencv("CORNER_REFINE_SUBPIX", 0.0)
    return found


def in_order(corners: FloatArray, like: FloatArray) -> FloatArray:
    """The corners from another one on, or the other way round, as those they are to be like."""
    turned = (np.roll(corners[::way], k, axis=0) for way in (1, -1) for k in range(4))
    best: FloatArray = min(turned, key=lambda each: float(np.abs(each - like).sum()))
    return best


def row(case: str, who: str, found: Tags, truth: Tags) -> Row:
    off, wrong = [], len(found.keys() - truth.keys())
    for tag in found.keys() & truth.keys():
        errors = np.linalg.norm(in_order(found[tag], truth[tag]) - truth[tag], axis=1)
        if errors.max() <= RIGHT_PX:
            off += errors.tolist()
        else:
            wrong += 1
    lost = len(truth.keys() - found.keys())
    return Row("tags", case, who, len(truth), len(off) // 4, wrong, lost, median(off), "px")


def aimed(own: Row, peer: Row) -> Row:
    """Our row with its aim: as many tags as ViSP, and corners no worse."""
    holds = own.right >= peer.right and own.wrong == 0
    if own.error is not None and peer.error is not None:
        holds = holds and own.error <= peer.error
    return Row(**own.record | {"aim": "no worse than ViSP", "holds": holds})


def rows() -> list[Row]:
    photograph = read_grey(FOLDER / "AprilTag.pgm")
    first = ours(photograph)
    truth = {
        tag: 0.5 * (corners + in_order(first[tag], corners))
        for tag, corners in package_corners().items()
    }
    found = []
    for case, spoil in CASES.items():
        image = spoil(photograph, 0)
        own, *peers = (row(case, who, ask(image), truth) for who, ask in detectors().items())
        if not PROGRAM.is_file():
            peers.insert(0, missing("tags", case, INSTALL_VISP))
        elif case != "clean":
            own = aimed(own, peers[0])
        found += [own, *peers]
    return found
