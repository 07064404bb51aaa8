"""A folder of calibration: pictures, the board, and perhaps the arm's poses."""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vergence.app.calibration.poses import find_poses, read_poses
from vergence.app.progress import bar
from vergence.app.tracking.footage import open_footage
from vergence.arrays import FloatArray
from vergence.camera.calibration import BadImage, Sighting
from vergence.errors import InputError, nearest
from vergence.tables import numbers, read_table, require_known
from vergence.vision.board import DICTIONARY, Board

BOARD = "board.toml"
_KEYS = ("columns", "rows", "square_mm", "marker_mm", "dictionary")
_NOT_FOUND = "no board found: all of it in view, sharp, the right numbers of inner corners?"


class Dataset(NamedTuple):
    """What there is to calibrate with."""

    board: Board
    width: int  # of the pictures, px
    height: int
    sightings: tuple[Sighting, ...]
    blank: tuple[BadImage, ...]  # without a board, or without a pose
    T_base_flange: FloatArray | None  # (N, 4, 4) of each sighting; None without arm poses


def read_dataset(folder: Path, board: Board | None, poses: Path | None) -> Dataset:
    """Read a folder and find the board in its pictures.

    Args:
        folder: of pictures; with `board.toml` and `poses.csv` beside them.
        board: instead of the folder's file.
        poses: instead of the folder's file.

    Raises:
        InputError: if a file cannot be used, or no board is described.
    """
    board = board or read_board(folder / BOARD)
    poses = poses or find_poses(folder)
    arm = None if poses is None else read_poses(poses)
    pictures = [(Path(p.name).name, p.image) for p in open_footage(folder).pictures()]
    _require_pictures(arm, [name for name, _ in pictures], poses)
    height, width = pictures[0][1].shape
    found: list[Sighting] = []
    blank: list[BadImage] = []
    progress = bar("{task.completed} / {task.total}")
    task = progress.add_task("find the board", total=len(pictures))
    with progress, ThreadPoolExecutor(4) as pool:
        seen = pool.map(lambda picture: board.find(picture[1], picture[0]), pictures)
        for (name, _), sighting in zip(pictures, seen, strict=True):
            progress.advance(task)
            if sighting is None:
                blank.append(BadImage(name, np.nan, _NOT_FOUND))
            elif arm is not None and name not in arm:
                blank.append(BadImage(name, np.nan, f"no pose of the arm in {poses}"))
            else:
                found.append(sighting)
    stack = None if arm is None else np.array([arm[s.name] for s in found]).reshape(-1, 4, 4)
    return Dataset(board, width, height, tuple(found), tuple(blank), stack)


def read_board(path: Path) -> Board:
    """Read the description of a board.

    Raises:
        InputError: if it is not there or cannot be used.
    """
    source = str(path)
    if not path.is_file():
        allowed = "--board 11x8 --square-mm 20, or this file with columns, rows and square_mm"
        raise InputError(source, "", "no such file", allowed)
    table = read_table(path, "a board")
    require_known(table, _KEYS, source)
    sizes = {key: float(numbers(table, key, (), source)) for key in _KEYS[:4] if key in table}
    for key in _KEYS[:3]:
        if key not in sizes:
            raise InputError(source, key, "nothing", "a number; this key is required")
    return make_board(sizes, str(table.get("dictionary", DICTIONARY)), source)


def board_of_options(
    size: str | None, square_mm: float | None, marker_mm: float | None, dictionary: str | None
) -> Board | None:
    """Make the board that options describe; None if there are none.

    Raises:
        InputError: if they do not describe a board.
    """
    if size is None:
        for key, value in (
            ("--square-mm", square_mm), ("--marker-mm", marker_mm), ("--dictionary", dictionary)
        ):  # fmt: skip
            if value is not None:
                raise InputError("vergence calibrate", key, value, "with --board COLUMNSxROWS")
        return None
    columns, _, rows = size.lower().partition("x")
    if not (columns.isdigit() and rows.isdigit()):
        allowed = "inner corners in a row x rows, such as 11x8"
        raise InputError("vergence calibrate", "--board", size, allowed)
    if square_mm is None:
        raise InputError("vergence calibrate", "--square-mm", "nothing", "a square's side in mm")
    sizes = {"columns": float(columns), "rows": float(rows), "square_mm": square_mm}
    if marker_mm is not None:
        sizes["marker_mm"] = marker_mm
    return make_board(sizes, dictionary or DICTIONARY, "vergence calibrate")


def make_board(sizes: Mapping[str, float], dictionary: str, source: str) -> Board:
    """Make a board of columns, rows, square_mm and perhaps marker_mm.

    Raises:
        InputError: naming the source, if there is no such board.
    """
    marker = sizes.get("marker_mm")
    try:
        return Board(
            int(sizes["columns"]),
            int(sizes["rows"]),
            1e-3 * sizes["square_mm"],
            None if marker is None else 1e-3 * marker,
            dictionary,
        )
    except InputError as error:
        raise InputError(source, error.key, error.given, error.allowed) from None


def write_board(path: Path, board: Board) -> None:
    """Write the description of a board."""
    lines = [
        f"columns = {board.columns}  # inner corners",
        f"rows = {board.rows}",
        f"square_mm = {1e3 * board.square_m:.9g}",
    ]
    if board.marker_m is not None:
        lines.append(f"marker_mm = {1e3 * board.marker_m:.9g}")
        lines.append(f'dictionary = "{board.dictionary}"')
    path.write_text("\n".join(lines) + "\n")


def _require_pictures(
    arm: Mapping[str, FloatArray] | None, names: list[str], poses: Path | None
) -> None:
    """Raise InputError if a pose is that of a picture that is not there."""
    for name in arm or ():
        if name not in names:
            raise InputError(str(poses), name, "no such picture", nearest(name, names))
