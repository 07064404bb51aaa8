"""Known objects in real images: held, wrong without a word, or said to be lost.

Nobody knows the true poses of the real cube. The reference is our own pose in each image, clean and
one after the other, where the pose explains the image (`object_judge.py`): from the package's
starting pose on, a cube cannot turn by a quarter between two images. Images that are worse, fewer
or hidden have the same true poses. The rendered castle comes with true poses.

Right is a pose that puts the corners within 4 px of where the reference puts them, on average.
Others are wrong if they lie beyond what is stated of them, or nothing is stated.
"""

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from typing import NamedTuple

import numpy as np

from footage_rows import Row, beyond, median, missing, over_stated
from object_judge import explained, shift_px
from real_images import (
    CUBE,
    IMAGES,
    PERIOD_S,
    RENDERED_CASTLE,
    SPOILS,
    KnownObject,
    Spoil,
    blurred,
    darkened,
    read_grey,
    smeared,
    spoilt,
)
from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.estimation.known_object.hypothesis_follower import HypothesisFollower
from vergence.estimation.known_object.object_follower import Sighting
from vergence.geometry import pose_difference
from vergence.vision.known_object import EdgeTracker, ObjectModel
from visp_tracker import PROGRAM, VispTracker

RIGHT_PX = 4.0
STEPS = {1: "", 2: "every second image", 3: "every third image", 6: "every sixth image"}
VISP_CASES = {"edges_points": "ViSP, edges and KLT", "edges": "ViSP, edges"}
INSTALL_VISP = "ViSP is not installed (apt-get install libvisp-dev g++, then make peers)"
COVER = "Klimt/Klimt.pgm"
CASES: Mapping[str, Spoil] = {
    **SPOILS,
    "blurred, σ 4 px": blurred(4.0),
    "smeared, 15 px": smeared(15),
    "a twentieth of the light": darkened(0.05),
}


class Reference(NamedTuple):
    """Poses to compare with."""

    poses: list[FloatArray]  # T_camera_target, (4, 4) each
    known: list[bool]  # where they are right


class Answers(NamedTuple):
    """What one tracker says of a sequence."""

    poses: list[FloatArray]
    told: list[bool]  # whether it says that it sees the object
    covariances: list[FloatArray]  # (6, 6) of (δp, δθ); empty if it states none


def ours(known: KnownObject, images: Sequence[ImageArray]) -> Answers:
    """Poses of `vergence track`."""
    follower = HypothesisFollower(
        EdgeTracker(known.model), known.camera, [known.first_pose()], 0.0, PERIOD_S
    )
    steps = [follower.follow(image, PERIOD_S * k) for k, image in enumerate(images)]
    return Answers(
        [step.T_camera_target for step in steps],
        [step.sighting is Sighting.SEEN for step in steps],
        [step.covariance[:6, :6] for step in steps],
    )


def reference(known: KnownObject, images: Sequence[ImageArray]) -> Reference:
    true = known.true_poses()
    if true is not None:
        return Reference(true, [True] * len(true))
    poses = ours(known, images).poses
    return Reference(poses, explained(images, poses, known.model, known.camera))


def hidden(
    images: Sequence[ImageArray], known: KnownObject, poses: Sequence[FloatArray]
) -> list[ImageArray]:
    """The images with a bar before the object, as wide as half of it, that passes to and fro."""
    import cv2

    model, camera = known.model, known.camera
    cover = cv2.resize(read_grey(IMAGES / COVER), (camera.width, camera.height))
    covered = []
    for number, (image, T) in enumerate(zip(images, poses, strict=True)):
        left, right = box(T, model, camera)
        width = 0.5 * (right - left)
        first = left + width * (0.5 + 0.5 * np.sin(number / 15.0))
        columns = slice(max(int(first), 0), max(int(first + width), 0))
        with_bar = image.copy()
        with_bar[:, columns] = cover[:, columns]
        covered.append(with_bar)
    return covered


def box(T: FloatArray, model: ObjectModel, camera: Camera) -> tuple[float, float]:
    """First and last column of an object in the image."""
    u = camera.project(model.vertices @ T[:3, :3].T + T[:3, 3])[:, 0]
    return float(u.min()), float(u.max())


def row(case: str, who: str, answers: Answers, known: KnownObject, truth: Reference) -> Row:
    """Count what a tracker says beside the reference."""
    model, camera = known.model, known.camera
    told = [k for k, seen in enumerate(answers.told) if seen and truth.known[k]]
    pairs = [(answers.poses[k], truth.poses[k]) for k in told]
    off = np.array([shift_px(T, T_true, model, camera) for T, T_true in pairs])
    right, wrong, stated = off[off <= RIGHT_PX], off > RIGHT_PX, None
    if answers.covariances and pairs:
        errors = np.array([pose_difference(T, T_true) for T, T_true in pairs])
        covariances = np.array([answers.covariances[k] for k in told])
        stated = over_stated(errors, covariances)
        wrong &= beyond(errors, covariances)
    total = sum(truth.known)
    return Row(
        "objects", case, who, total, len(right), int(wrong.sum()), total - len(told),
        median(right), "px", stated,
    )  # fmt: skip


def aimed(own: Row, peers: Sequence[Row]) -> Row:
    """Our row with the aim: never wrong, and no fewer right than ViSP's."""
    best = max((peer.right for peer in peers), default=0)
    aim = "never wrong" + (", no fewer right than ViSP" if peers else "")
    return Row(**own.record | {"aim": aim, "holds": own.wrong == 0 and own.right >= best})


def rows_of_case(
    case: str,
    known: KnownObject,
    images: Sequence[ImageArray],
    truth: Reference,
    steps: Sequence[int],
) -> list[Row]:
    """Our rows and ViSP's: of these images, at each step."""
    rows = []
    with VispTracker(known, images) if PROGRAM.is_file() else nullcontext() as visp:
        for step in steps:
            name = ", ".join(filter(None, (known.name, case, STEPS[step])))
            chosen = Reference(truth.poses[::step], truth.known[::step])
            own = row(name, "vergence", ours(known, images[::step]), known, chosen)
            peers = []
            for visp_case, who in VISP_CASES.items() if visp else ():
                seen = visp.follow(visp_case, step)
                answers = Answers(seen.poses, [not lost for lost in seen.lost], [])
                peers.append(row(name, who, answers, known, chosen))
            rows += [aimed(own, peers), *(peers or [missing("objects", name, INSTALL_VISP)])]
    return rows


def rows() -> list[Row]:
    found: list[Row] = []
    for known in (CUBE, RENDERED_CASTLE):
        images = known.images()
        truth = reference(known, images)
        for case, spoil in CASES.items():
            steps = tuple(STEPS) if case == "clean" else (1,)
            found += rows_of_case(case, known, spoilt(images, spoil), truth, steps)
        covered = hidden(images, known, truth.poses)
        found += rows_of_case("half of it hidden", known, covered, truth, (1,))
    return found
