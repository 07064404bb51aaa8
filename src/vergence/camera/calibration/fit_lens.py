"""The lens of a camera, from images of a board."""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.board_pose import board_pose, pose_of
from vergence.camera.calibration.failure import CalibrationFailure
from vergence.camera.calibration.lens_fit import LensFit
from vergence.camera.calibration.normal_equations import (
    Share,
    covariance,
    jackknife,
    steps_without,
)
from vergence.camera.calibration.reprojection import (
    LENS,
    camera_with,
    lens_of,
    reproject,
    residuals,
    rms,
)
from vergence.camera.calibration.sighting import BadImage, Sighting, pixels
from vergence.camera.pinhole import Camera
from vergence.errors import InputError

FEWEST_IMAGES = 4
MODELS = {  # which distortion coefficients are estimated
    "none": (),
    "k1": ("k1",),
    "k1k2": ("k1", "k2"),
    "k1k2p1p2": ("k1", "k2", "p1", "p2"),
    "full": ("k1", "k2", "p1", "p2", "k3"),
}
_FLATTEST_DEG = 8.0  # the board must be seen turned by more than this
_SUSPICIOUS = 3.0  # times the median residual of all images
_SAME_PX = 0.3  # rms: nearer, two images show the board in one pose
_SMALLEST_PX = 0.3  # residuals below never count as contradicting


def fit_lens(
    sightings: Sequence[Sighting],
    width: int,
    height: int,
    model: str = "full",
    known: Camera | None = None,
) -> LensFit | CalibrationFailure:
    """Estimate a lens, leaving out images that the others contradict.

    OpenCV minimises the squared distances of all corners over lens and poses, from the closed form
    of [Zhang2000]. Then the image with the largest residual goes while it is far beyond the
    usual.

    Args:
        sightings: of one board, in images by one camera.
        width: of the images, px.
        height: of the images.
        model: a key of `MODELS`.
        known: the camera, if it is known already: then only images and poses are judged.

    Returns:
        the fit, or why these images do not determine it.
    """
    if model not in MODELS:
        raise InputError("fit_lens", "model", model, ", ".join(MODELS))
    kept, copies = _without_copies(sightings)
    bad = list[BadImage]()
    while True:
        reason = _too_few(kept, bad, copies)
        if reason:
            return CalibrationFailure(reason)
        if known is None:
            camera, poses = _opencv(kept, width, height, model)
        else:
            camera, poses = known, np.array([board_pose(known, seen) for seen in kept])
        lens = lens_of(camera)
        sizes = np.array(
            [rms(residuals(lens, T, seen)) for T, seen in zip(poses, kept, strict=True)]
        )
        worst = int(sizes.argmax())
        usual = float(np.median(sizes))
        if sizes[worst] <= max(_SUSPICIOUS * usual, _SMALLEST_PX):
            break
        reason = (
            f"its corners are {pixels(sizes[worst])} from any image of a flat board; in "
            "the other images "
            f"{pixels(usual)} is usual: a blurred image, a bent board, or another board"
        )
        bad.append(BadImage(kept[worst].name, float(sizes[worst]), reason))
        del kept[worst]
    turned = _spread_deg(poses)
    if turned < _FLATTEST_DEG and known is None:
        return CalibrationFailure(
            f"the board has the same orientation in all images, within {turned:.1f}°, "
            "which does not "
            "determine the focal length: add images with the board tilted by 20 to 45° about "
            "different axes"
        )
    free = np.zeros(9) if known is not None else free_parameters(model)
    return _finished(camera, poses, kept, [*copies, *bad], free)


def free_parameters(model: str) -> FloatArray:
    """Return which parameters of a lens a model estimates, (9,), 0 or 1."""
    return np.array([1.0] * 4 + [float(name in MODELS[model]) for name in LENS[4:]])


def _without_copies(sightings: Sequence[Sighting]) -> tuple[list[Sighting], list[BadImage]]:
    """Return the sightings that differ, and those that repeat one of them."""
    kept, copies = list[Sighting](), list[BadImage]()
    for seen in sightings:
        same = next((other for other in kept if _same(seen, other)), None)
        if same is None:
            kept.append(seen)
            continue
        reason = f"the board is at the same place as in {same.name}: a copy, or nothing had moved"
        copies.append(BadImage(seen.name, np.nan, reason))
    return kept, copies


def _same(one: Sighting, other: Sighting) -> bool:
    if not np.array_equal(one.points, other.points):
        return False
    return rms((one.points_px - other.points_px).ravel()) < _SAME_PX


def _too_few(kept: Sequence[Sighting], bad: Sequence[BadImage], copies: Sequence[BadImage]) -> str:
    if len(kept) < FEWEST_IMAGES:
        gone = [f"{len(bad)} bad ones"] * bool(bad) + [f"{len(copies)} copies"] * bool(copies)
        without = f" without {' and '.join(gone)}" if gone else ""
        return (
            f"the board was found in {len(kept)} different images{without}; at least "
            f"{FEWEST_IMAGES} are needed, 15 to 30 are good"
        )
    if len(bad) > len(kept):
        return (
            f"{len(bad)} of {len(bad) + len(kept)} images contradict the others: is it "
            "the board given, is it flat, and were all taken by one camera with fixed focus?"
        )
    return ""


def _opencv(
    kept: Sequence[Sighting], width: int, height: int, model: str
) -> tuple[Camera, FloatArray]:
    import cv2

    flags = 0
    for names, flag in (
        (("k1",), cv2.CALIB_FIX_K1),
        (("k2",), cv2.CALIB_FIX_K2),
        (("p1", "p2"), cv2.CALIB_ZERO_TANGENT_DIST),
        (("k3",), cv2.CALIB_FIX_K3),
    ):
        if not set(names) & set(MODELS[model]):
            flags |= flag
    _, A, k, rotations, positions = cv2.calibrateCamera(
        [seen.points.astype(np.float32) for seen in kept],
        [seen.points_px.astype(np.float32) for seen in kept],
        (width, height),
        np.eye(3),
        np.zeros(5),
        flags=flags,
        criteria=(cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-12),
    )
    distortion = np.ravel(k)[:5].astype(np.float64)
    fx, fy, cx, cy = (float(A[place]) for place in ((0, 0), (1, 1), (0, 2), (1, 2)))
    camera = Camera(width, height, fx, fy, cx, cy, distortion)
    poses = [pose_of(w, t) for w, t in zip(rotations, positions, strict=True)]
    return camera, np.array(poses)


def _spread_deg(poses: FloatArray) -> float:
    """Return the largest angle between the board's planes in two images, degrees."""
    normals = poses[:, :3, 2]
    cosines = np.abs(normals @ normals.T)
    return float(np.rad2deg(np.arccos(np.clip(cosines.min(), -1.0, 1.0))))


def _finished(
    camera: Camera,
    poses: FloatArray,
    kept: Sequence[Sighting],
    bad: Sequence[BadImage],
    free: FloatArray,
) -> LensFit:
    lens = lens_of(camera)
    shares, left = [], []
    for T, seen in zip(poses, kept, strict=True):
        _, by_lens, by_pose = reproject(lens, T, seen.points)
        left.append(residuals(lens, T, seen))
        shares.append(Share.of(by_lens, left[-1], by_pose))
    every = np.concatenate(left)
    variance = float(every @ every) / (len(every) - free.sum() - 6 * len(kept))
    steps = steps_without(shares, free)
    return LensFit(
        camera,
        covariance(shares, free, variance),
        jackknife(steps),
        float(np.sqrt(variance)),
        tuple(kept),
        poses,
        tuple(left),
        np.array([_alone(lens + d, camera, s) for d, s in zip(steps, kept, strict=True)]),
        tuple(bad),
    )


def _alone(lens: FloatArray, like: Camera, seen: Sighting) -> float:
    """Return the rms of an image whose pose alone is fitted, under a lens, px."""
    camera = camera_with(lens, like)
    return rms(residuals(lens, board_pose(camera, seen), seen))
