"""Files that describe a calibration board."""

from collections.abc import Mapping
from pathlib import Path

from vergence.errors import NOTHING, InputError
from vergence.places import no_file
from vergence.tables import numbers, read_table, require_known
from vergence.vision.board import DICTIONARY, PATTERNS, Board

BOARD = "board.toml"
_KEYS = ("columns", "rows", "square_mm", "marker_mm", "dictionary", "pattern")


def read_board(path: str | Path) -> Board:
    """Read the description of a board.

    Raises:
        InputError: if the file does not exist or cannot be used.
    """
    path, source = Path(path), str(path)
    if not path.is_file():
        allowed = "--board 11x8 --square-mm 20, or this file with columns, rows and square_mm"
        raise InputError(source, "", no_file(path), allowed)
    table = read_table(path, "a board")
    require_known(table, _KEYS, source)
    sizes = {key: float(numbers(table, key, (), source)) for key in _KEYS[:4] if key in table}
    for key in _KEYS[:3]:
        if key not in sizes:
            raise InputError(source, key, NOTHING, "a number")
    dictionary, pattern = (
        str(table.get(key, usual)) for key, usual in (("dictionary", DICTIONARY), ("pattern", ""))
    )
    return make_board(sizes, dictionary, source, pattern)


def make_board(
    sizes: Mapping[str, float], dictionary: str, source: str, pattern: str = ""
) -> Board:
    """Return a board of the given columns, rows, square_mm and, if present, marker_mm.

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
            pattern or PATTERNS[0],
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
    if board.pattern != PATTERNS[0]:
        lines.append(f'pattern = "{board.pattern}"')
    if board.marker_m is not None:
        lines.append(f"marker_mm = {1e3 * board.marker_m:.9g}")
        lines.append(f'dictionary = "{board.dictionary}"')
    path.write_text("\n".join(lines) + "\n")
