"""A folder of calibration: images, the board, and perhaps the arm's poses."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vergence.app.progress import bar
from vergence.arrays import FloatArray
from vergence.camera.calibration import BadImage, Sighting, find_board
from vergence.camera.calibration.arm_poses import find_poses, read_poses
from vergence.camera.image_file import image_files
from vergence.errors import NOTHING, Absent, InputError, nearest
from vergence.vision.board import DICTIONARY, Board
from vergence.vision.board_file import BOARD, make_board, read_board


class Dataset(NamedTuple):
    """What there is to calibrate with."""

    board: Board
    width: int  # of the images, px
    height: int
    sightings: tuple[Sighting, ...]
    blank: tuple[BadImage, ...]  # without a board, or without a pose
    T_base_flange: FloatArray | None  # (N, 4, 4) of each sighting; None without arm poses


def read_dataset(folder: Path, board: Board | None, poses: Path | None) -> Dataset:
    """Read a folder and find the board in its images.

    Args:
        folder: of images; with `board.toml` and `poses.csv` beside them.
        board: instead of the folder's file.
        poses: instead of the folder's file.

    Raises:
        InputError: if a file cannot be used, or no board is described.
    """
    if not folder.is_dir():
        raise InputError(str(folder), "", Absent("no such folder"), "a folder of images")
    board = board or read_board(folder / BOARD)
    poses = poses or find_poses(folder)
    arm = None if poses is None else read_poses(poses)
    names = [file.name for file in image_files(folder)]
    _require_images(arm, names, poses)
    progress = bar("{task.completed} / {task.total}")
    task = progress.add_task("find the board", total=len(names))
    with progress:
        images = find_board(folder, board, lambda count: progress.update(task, advance=count))
    found = [seen for seen in images.sightings if arm is None or seen.name in arm]
    without = [s.name for s in images.sightings if arm is not None and s.name not in arm]
    reason = f"no pose of the arm in {poses}"
    blank = [*images.blank, *(BadImage(name, np.nan, reason) for name in without)]
    stack = None if arm is None else np.array([arm[s.name] for s in found]).reshape(-1, 4, 4)
    return Dataset(board, images.width, images.height, tuple(found), tuple(blank), stack)


def board_of_options(
    size: str | None,
    square_mm: float | None,
    marker_mm: float | None,
    dictionary: str | None,
    pattern: str | None,
) -> Board | None:
    """Make the board that options describe; None if there are none.

    Raises:
        InputError: if they do not describe a board.
    """
    if size is None:
        for key, value in (
            ("--square-mm", square_mm), ("--marker-mm", marker_mm), ("--dictionary", dictionary),
            ("--pattern", pattern),
        ):  # fmt: skip
            if value is not None:
                raise InputError("vergence calibrate", key, value, "with --board COLUMNSxROWS")
        return None
    columns, _, rows = size.lower().partition("x")
    if not (columns.isdigit() and rows.isdigit()):
        allowed = "inner corners in a row x rows, such as 11x8"
        raise InputError("vergence calibrate", "--board", size, allowed)
    if square_mm is None:
        raise InputError("vergence calibrate", "--square-mm", NOTHING, "a square's side in mm")
    sizes = {"columns": float(columns), "rows": float(rows), "square_mm": square_mm}
    if marker_mm is not None:
        sizes["marker_mm"] = marker_mm
    try:
        return make_board(sizes, dictionary or DICTIONARY, "vergence calibrate", pattern or "")
    except InputError as error:
        option, given = {
            "square": ("--square-mm", f"{square_mm:g}"),
            "marker": ("--marker-mm", f"{marker_mm or 0.0:g}"),
            "columns": ("--board", size),
            "rows": ("--board", size),
        }.get(error.key, (f"--{error.key}", error.given))
        raise InputError(error.source, option, given, error.allowed) from None


def _require_images(
    arm: Mapping[str, FloatArray] | None, names: list[str], poses: Path | None
) -> None:
    """Raise InputError if a pose is that of an image that is not there."""
    for name in arm or ():
        if name not in names:
            raise InputError(str(poses), name, Absent("no such image"), nearest(name, names))
