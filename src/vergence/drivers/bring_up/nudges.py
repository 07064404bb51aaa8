"""Small moves of one joint after another, compared with the joints and the images."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.drivers.bring_up.finding import Finding
from vergence.drivers.bring_up.watched import SlowMotion
from vergence.features import interaction_matrix_points
from vergence.robot import Arm
from vergence.runtime.driver import Driver

_MOVED = 0.25  # share of the move by which a joint may miss it
_FEW_PX = 1.0  # of predicted image motion, below which an image does not tell
_ALIKE = 0.7  # cosine between predicted and seen image motion
_FRAME_TIMEOUT_S = 3.0


class CarriedCamera(NamedTuple):
    """A camera on the arm, for what its images should do when a joint moves."""

    name: str
    camera: Camera
    arm: Arm  # with the camera as its tip
    depth_m: float  # of what it looks at, roughly


def nudge_findings(
    driver: Driver, name: str, by: FloatArray, camera: CarriedCamera | None
) -> Iterator[Finding]:
    """Move each joint to and fro, and yield what did not follow.

    Args:
        driver: of the arm.
        name: of the arm.
        by: how far to move each joint, (n,), rad or m; its sign is turned where a limit is near.
        camera: on the arm; its images tell whether model and robot turn the same way.
    """
    arm, motion = driver.arms[name], SlowMotion(driver, name)
    for joint, joint_name in enumerate(arm.names):
        before, image = _rest(driver, name, motion, camera)
        room = arm.q_max[joint] - before[joint] > 2 * by[joint]
        step = by[joint] if room else -by[joint]
        travelled = motion.drive(joint, step)
        after, moved_image = _rest(driver, name, motion, camera)
        yield _joint_finding(joint_name, arm.names, joint, after - before, step)
        yield _rate_finding(joint_name, travelled, after[joint] - before[joint])
        if camera is not None and image is not None and moved_image is not None:
            change = np.zeros(arm.joint_count)
            change[joint] = step
            yield _image_finding(joint_name, camera, before, change, image, moved_image)
        motion.drive(joint, -step)


def _rest(
    driver: Driver, name: str, motion: SlowMotion, camera: CarriedCamera | None
) -> tuple[FloatArray, ImageArray | None]:
    """Return the joints at rest and an image that was exposed at rest."""
    sample = driver.read()
    since, image = sample.time, None
    while sample.time < since + _FRAME_TIMEOUT_S and image is None:
        motion.hold()
        sample = driver.read()
        fresh = [f for f in sample.frames if camera is not None and f.camera == camera.name]
        image = next((f.image for f in reversed(fresh) if f.time > since), None)
        if camera is None and sample.time > since + 0.2:
            break
    return sample.joints[name].position, image


def _joint_finding(
    joint_name: str, names: tuple[str, ...], joint: int, moved: FloatArray, step: float
) -> Finding:
    """Return whether the joint that was commanded to move did, and no other."""
    share, farthest = moved[joint] / step, int(np.argmax(np.abs(moved)))
    note = ""
    if farthest != joint:
        note = f"{names[farthest]} moved instead: the joints are in another order"
    elif share < 0:
        note = "it moved the other way: the sign differs"
    elif abs(share - 1.0) > _MOVED:
        note = "it moved by another amount: degrees for radians, a gear, or a brake"
    return Finding(
        f"{joint_name} moves as commanded",
        float(share),
        "of the move",
        "0.75 to 1.25",
        not note,
        note,
    )


def _rate_finding(joint_name: str, travelled: float, moved: float) -> Finding:
    """Return whether the rate that a joint reports is that of its position."""
    share = travelled / moved if moved else 0.0
    name, holds = f"{joint_name} reports its rate", 0.5 <= share <= 1.5
    note = "" if holds else "its rate is of another unit or sign, or is not reported"
    return Finding(name, float(share), "of the move", "0.5 to 1.5", holds, note)


def _image_finding(
    joint_name: str,
    camera: CarriedCamera,
    q: FloatArray,
    change: FloatArray,
    before: ImageArray,
    after: ImageArray,
) -> Finding:
    """Compare how points moved in the image with what the model says."""
    name = f"{joint_name} turns as in the model"
    start, end = followed(before, after)
    if len(start) < 4:
        return Finding(
            name, float("nan"), "cosine", "0.7 or more", True, "too little texture to tell"
        )
    points = camera.camera.normalize(start)
    L = interaction_matrix_points(points, np.full(len(points), camera.depth_m))
    flow = (L @ camera.arm.jacobian(q) @ change).reshape(-1, 2)
    predicted = camera.camera.to_pixels(points + flow) - start
    seen = end - start
    size = float(np.median(np.linalg.norm(predicted, axis=1)))
    if size < _FEW_PX:
        return Finding(
            name, float("nan"), "cosine", "0.7 or more", True, "it hardly moves the image"
        )
    lengths = np.linalg.norm(predicted, axis=1) * np.linalg.norm(seen, axis=1)
    alike = float(np.median((predicted * seen).sum(axis=1) / np.maximum(lengths, 1e-9)))
    note = "" if alike >= _ALIKE else "sign or zero of the joint, or the camera's mounting"
    return Finding(name, alike, "cosine", "0.7 or more", alike >= _ALIKE, note)


def _untold(name: str, why: str) -> Finding:
    return Finding(name, float("nan"), "cosine", "0.7 or more", True, why)


def followed(before: ImageArray, after: ImageArray) -> tuple[FloatArray, FloatArray]:
    """Return points of one image and where they are in another, (M, 2) each, px."""
    import cv2

    corners = cv2.goodFeaturesToTrack(before, 100, 0.05, 12.0)
    if corners is None:
        return np.empty((0, 2)), np.empty((0, 2))
    nowhere: Any = None  # OpenCV's stubs do not know that it may be absent
    there, found, _ = cv2.calcOpticalFlowPyrLK(before, after, corners, nowhere, winSize=(31, 31))
    back, also, _ = cv2.calcOpticalFlowPyrLK(after, before, there, nowhere, winSize=(31, 31))
    round_trip = np.linalg.norm((back - corners).reshape(-1, 2), axis=1) < 0.5
    good = (found.ravel() == 1) & (also.ravel() == 1) & round_trip
    start, end = (np.asarray(each, np.float64).reshape(-1, 2)[good] for each in (corners, there))
    return start, end
