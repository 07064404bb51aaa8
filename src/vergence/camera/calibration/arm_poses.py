"""Files of recorded arm poses: which image was taken where."""

import csv
from collections.abc import Iterator, Mapping
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import NOTHING, Absent, InputError, nearest
from vergence.geometry import matrix_to_quaternion, quaternion_to_matrix, se3
from vergence.tables import numbers, read_table, read_text, require_known

NAMES = ("poses.csv", "poses.toml", "poses.json", "poses.yaml")
COLUMNS = ("image", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
_KEYS = ("image", "position_m", "quaternion_wxyz")
_MOST_BYTES = 10_000_000
_FARTHEST_M = 20.0  # no arm reaches farther: the numbers are not in metres


def find_poses(folder: Path) -> Path | None:
    """Return the file of poses in a folder, if there is one."""
    return next((folder / name for name in NAMES if (folder / name).is_file()), None)


def read_poses(path: Path) -> dict[str, FloatArray]:
    """Read T_base_flange (4, 4) for each image, by the image's file name.

    A CSV file has the columns image, x_m, y_m, z_m, qw, qx, qy, qz; a TOML or JSON file a list
    `poses` of tables with image, position_m and quaternion_wxyz.

    Raises:
        InputError: if anything in it cannot be used; file and row are named.
    """
    rows = _csv_rows(path) if path.suffix.lower() == ".csv" else _table_rows(path)
    poses: dict[str, FloatArray] = {}
    for place, row in rows:
        name = Path(str(row["image"])).name
        if name in poses:
            raise InputError(str(path), place, f"{name} a second time", "one pose per image")
        poses[name] = _pose(row, str(path), place)
    return poses


def write_poses(path: Path, poses: Mapping[str, FloatArray]) -> None:
    """Write T_base_flange of each image as CSV."""
    with path.open("w", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(COLUMNS)
        for name, T in poses.items():
            values = (*T[:3, 3], *matrix_to_quaternion(np.ascontiguousarray(T[:3, :3])))
            table.writerow([name, *(f"{value:.9f}" for value in values)])


def _csv_rows(path: Path) -> Iterator[tuple[str, Mapping[str, Any]]]:
    text = read_text(path, "recorded arm poses", _MOST_BYTES)
    table = csv.DictReader(StringIO(text, newline=""), skipinitialspace=True)
    try:
        header = table.fieldnames or ()
        for name in COLUMNS:
            if name not in header:
                given = ", ".join(header) or NOTHING
                raise InputError(str(path), "row 1", given, ", ".join(COLUMNS))
        for row in table:
            yield f"row {table.line_num}", _pose_row(row, path, table.line_num)
    except csv.Error as error:
        raise InputError(str(path), f"row {table.line_num}", error, "a row of CSV") from None


def _pose_row(row: dict[Any, Any], path: Path, number: int) -> Mapping[str, Any]:
    if None in row or None in row.values():
        given = "another number of values"
        raise InputError(str(path), f"row {number}", given, "as many as names")
    return {
        "image": row["image"].strip(),
        "position_m": [row[name] for name in COLUMNS[1:4]],
        "quaternion_wxyz": [row[name] for name in COLUMNS[4:]],
    }


def _table_rows(path: Path) -> Iterator[tuple[str, Mapping[str, Any]]]:
    table = read_table(path, "recorded arm poses")
    require_known(table, ("poses",), str(path))
    rows = table.get("poses")
    if not isinstance(rows, list) or not all(isinstance(row, Mapping) for row in rows):
        raise InputError(
            str(path), "poses", Absent("no list of tables"), "[[poses]] with " + ", ".join(_KEYS)
        )
    for number, row in enumerate(rows, start=1):
        place = f"poses, number {number}"
        for key in row:
            if key not in _KEYS:
                raise InputError(str(path), f"{place}: {key}", "not known", nearest(key, _KEYS))
        if "image" not in row:
            raise InputError(str(path), f"{place}: image", NOTHING, "the image's file name")
        yield place, row


def _pose(row: Mapping[str, Any], source: str, place: str) -> FloatArray:
    named = {f"{place}: {key}": value for key, value in row.items()}
    position = numbers(named, f"{place}: position_m", (3,), source)
    q = numbers(named, f"{place}: quaternion_wxyz", (4,), source)
    if np.abs(position).max() > _FARTHEST_M:
        raise InputError(source, f"{place}: position_m", position.tolist(), "metres")
    if abs(np.linalg.norm(q) - 1.0) > 0.01:
        allowed = "a unit quaternion w, x, y, z"
        raise InputError(source, f"{place}: quaternion_wxyz", q.tolist(), allowed)
    T: FloatArray = se3(quaternion_to_matrix(q / np.linalg.norm(q)), position)
    return T
