"""Calibration from a folder of images: what `vergence calibrate` does, for programs."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vergence.arrays import ImageArray
from vergence.camera.calibration.arm_poses import read_poses
from vergence.camera.calibration.calibration_board import CalibrationBoard
from vergence.camera.calibration.failure import CalibrationFailure
from vergence.camera.calibration.fit_lens import FEWEST_IMAGES, fit_lens
from vergence.camera.calibration.fit_mounting import SCALE_DEVIATION, fit_mounting
from vergence.camera.calibration.lens_fit import LensFit
from vergence.camera.calibration.mounting_fit import MountingFit
from vergence.camera.calibration.sighting import BadImage, Sighting
from vergence.camera.image_file import image_files
from vergence.camera.image_folder import grey_images
from vergence.camera.pinhole import Camera
from vergence.errors import Absent, InputError

_THREADS = 4
_IN_MEMORY = 8  # images at a time
_EXPLAINED = 3  # images without a board that are searched for another
_NOT_FOUND = "no board found: is all of it in view, sharp, with the right numbers of corners?"


class BoardImages(NamedTuple):
    """A folder's images, and where they show the board."""

    width: int  # px
    height: int
    sightings: tuple[Sighting, ...]
    blank: tuple[BadImage, ...]  # without a board


def find_board(
    folder: Path, board: CalibrationBoard, advance: Callable[[int], None] = lambda _: None
) -> BoardImages:
    """Find a board in the images of a folder, which are read a few at a time.

    Args:
        folder: of images.
        board: what to find.
        advance: called with the number of images that were searched.

    Raises:
        InputError: if the folder or an image cannot be read.
    """
    if not folder.is_dir():
        raise InputError(str(folder), "", Absent("no such folder"), "a folder of images")
    files = image_files(folder)
    images = grey_images(files)
    found: list[Sighting] = []
    blank: list[tuple[str, ImageArray | None]] = []
    height = width = 0
    with ThreadPoolExecutor(_THREADS) as pool:
        while some := list(islice(images, _IN_MEMORY)):
            height, width = some[0][1].shape
            seen = pool.map(lambda each: board.find(each[1], each[0].name), some)
            for (file, image), sighting in zip(some, seen, strict=True):
                if sighting is None:
                    blank.append((file.name, image if len(blank) < _EXPLAINED else None))
                else:
                    found.append(sighting)
            advance(len(some))
    explain = board.seen_instead if len(found) < FEWEST_IMAGES else None
    reasons = [_blank_reason(image, explain) for _, image in blank]
    bad = [BadImage(name, np.nan, why) for (name, _), why in zip(blank, reasons, strict=True)]
    return BoardImages(width, height, tuple(found), tuple(bad))


def _blank_reason(image: ImageArray | None, explain: Callable[[ImageArray], str] | None) -> str:
    other = explain(image) if explain is not None and image is not None else ""
    return f"no board of this kind found: {other}" if other else _NOT_FOUND


def calibrate_lens(
    folder: str | Path, board: CalibrationBoard, model: str = "full", camera: Camera | None = None
) -> LensFit | CalibrationFailure:
    """Estimate a camera's lens from a folder of images of a board.

    Args:
        folder: of images.
        board: in them.
        model: which distortion is estimated, a key of `MODELS`.
        camera: if it is known already.

    Returns:
        the fit, with all images that were left out; or why these images do not determine it.

    Raises:
        InputError: if the folder or an image cannot be read.
    """
    images = find_board(Path(folder), board)
    fit = fit_lens(images.sightings, images.width, images.height, model, camera)
    if isinstance(fit, CalibrationFailure):
        return with_reason(fit, images.blank)
    return replace(fit, bad=(*images.blank, *fit.bad), board=board)


def calibrate_mounting(
    folder: str | Path,
    lens: LensFit,
    poses: str | Path = "poses.csv",
    *,
    fixed: bool = False,
    scale_deviation: float = SCALE_DEVIATION,
    seed: int = 0,
) -> MountingFit | CalibrationFailure:
    """Estimate where a camera is mounted, from the arm's poses at the images of a lens's fit.

    Args:
        folder: of the images.
        lens: what `calibrate_lens` found in it.
        poses: file of the flange's poses, in the folder or anywhere.
        fixed: the camera is fixed and the arm carries the board.
        scale_deviation: standard deviation of the board's size, as a share of it.
        seed: of the images that starts are made of.

    Raises:
        InputError: if the poses cannot be read.
    """
    inside = Path(folder) / poses
    arm = read_poses(inside if inside.is_file() else Path(poses))
    seen = [sighting for sighting in lens.sightings if sighting.name in arm]
    turned = (lambda each: (each,)) if lens.board is None else lens.board.orientations
    fit = fit_mounting(
        [turned(sighting) for sighting in seen],
        np.array([arm[sighting.name] for sighting in seen]).reshape(-1, 4, 4),
        lens.camera,
        lens.noise_px,
        fixed=fixed,
        free=(lens.deviations > 0.0).astype(np.float64),
        scale_deviation=scale_deviation,
        rng=np.random.default_rng(seed),
    )
    if isinstance(fit, CalibrationFailure):
        return fit
    without = [s.name for s in lens.sightings if s.name not in arm]
    bad = [BadImage(name, np.nan, f"no pose of the arm in {poses}") for name in without]
    return replace(fit, bad=(*bad, *fit.bad))


def with_reason(failure: CalibrationFailure, blank: tuple[BadImage, ...]) -> CalibrationFailure:
    """Return a failure that also says what the images without a board show instead."""
    other = next((each.reason for each in blank if each.reason != _NOT_FOUND), "")
    return CalibrationFailure(f"{failure.reason}; {other}" if other else failure.reason)
