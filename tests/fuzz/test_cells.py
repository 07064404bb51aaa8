"""Cell files, and values of `--set`, that say anything."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from untrusted import ends_well, mutants

from vergence.cell import load_cell
from vergence.cell.schema import TABLES
from vergence.control import ServoSettings
from vergence.errors import InputError
from vergence.parts import field_names
from vergence.places import CELL, CELLS
from vergence.registry import find, kinds

GOOD = (CELLS / "four_cameras" / CELL).read_bytes()
NUMBERS = (
    "0",
    "-1",
    "1e30",
    "1e-30",
    "1e400",
    "inf",
    "nan",
    "true",
    "9223372036854775807",
    "9" * 400,
    "9" * 4300,
    "9" * 5000,
    "[]",
    "{}",
    "[" * 500 + "]" * 500,
    "[" * 5000,
    '""',
    '"\\u0000"',
    '"$\\\\bad{$"',
    "'" + "x" * 20_000 + "'",
    "[[[1]]]",
    "1\nlaw = 2",
    "1979-05-27",
    "{kind = 'zzz'}",
    "{kind = 1}",
    "{kind = []}",
)


def keys() -> list[str]:
    """Return every key that a cell file may have, and some that it may not."""
    found = [f"{place}.{key}" for place, table in TABLES.items() for key in table.model_fields]
    cell = load_cell("four_cameras")
    for arm in cell.arms:
        found += [f"arms.{arm}.{key}" for key in TABLES["arms"].model_fields]
    for camera in cell.cameras:
        found += [f"cameras.{camera}.{key}" for key in TABLES["cameras"].model_fields]
    found += [f"task.{key}" for key in TABLES["follow"].model_fields]
    for role in ("objective", "solver", "limits"):
        below = "" if role == "objective" else f"{role}."
        for kind in kinds(role):
            found += [f"law.{below}{key}" for key in field_names(find(role, kind))]
    found += [f"law.{key}" for key in (*field_names(ServoSettings), "kind", "weight", "camera")]
    for kind in kinds("motion"):
        found += [f"target.motion.{key}" for key in field_names(find("motion", kind))]
    odd = ["", ".", "a..b", "$\\bad{$", "laws.$\\bad{$", "x" * 30_000, ".".join("a" * 9000)]
    return [*found, *load_cell("four_cameras").model_dump(), *odd]


@given(mutants(GOOD))
def test_a_mutant_of_a_cell_is_loaded_or_refused_in_one_sentence(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "mutant.toml"
    path.write_bytes(data)
    ends_well(lambda: load_cell(path))


@given(st.dictionaries(st.sampled_from(keys()), st.sampled_from(NUMBERS) | st.text(), max_size=3))
def test_any_setting_is_taken_or_refused_in_one_sentence(settings: dict[str, str]) -> None:
    ends_well(lambda: load_cell("four_cameras", settings))


def test_a_file_without_end_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    with path.open("wb") as file:
        file.truncate(1 << 40)  # takes no room on the disk
    with pytest.raises(InputError, match="at most 262144 bytes"):
        load_cell(path)


@pytest.mark.parametrize(
    "name", ["$\\bad{$", "a/b", "", "-x", "x" * 65, "a\nb", "a\u202eb", " a", "<b>"]
)
def test_what_is_named_oddly_is_refused(name: str) -> None:
    quoted = name.encode("unicode_escape").decode().replace('"', '\\"')
    law = f'laws = {{ "{quoted}" = {{ kind = "image_based" }} }}'.partition(" = ")[2]
    with pytest.raises(InputError):
        load_cell("puma560", {"laws": law})


def _numbers(schema: Any, place: str) -> list[tuple[str, Any]]:
    """Return the parts of a JSON schema that describe numbers, lists, tables and text."""
    if isinstance(schema, list):
        return [found for part in schema for found in _numbers(part, place)]
    if not isinstance(schema, dict):
        return []
    own = [(place, schema)] if schema.get("type") in ("number", "integer", "array") else []
    return own + [
        found for key, part in schema.items() for found in _numbers(part, f"{place}.{key}")
    ]


def test_every_number_has_a_range_with_both_ends_and_every_list_a_length() -> None:
    from vergence.cell import Cell

    parts = _numbers(Cell.model_json_schema(), "")
    assert len(parts) > 100
    for place, part in parts:
        if part["type"] == "array":
            assert part.get("maxItems", 10_000) <= 4096, place
            continue
        assert {"minimum", "exclusiveMinimum"} & part.keys(), place
        assert {"maximum", "exclusiveMaximum"} & part.keys(), place
