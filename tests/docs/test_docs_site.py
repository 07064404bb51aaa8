"""The documentation holds what it promises: an entry for every citation, a page for every room."""

import re
from importlib import import_module
from pathlib import Path

import cv2
import pytest
from cell_file import reference
from command_line import reference as commands
from docutils import nodes
from docutils.utils import new_document
from gallery import gallery
from public_names import described, meaning
from public_names import reference as public_names
from table_names import keep_together, let_break

import vergence
from vergence.cell import schema
from vergence.places import built_in_cells

SOURCE = Path(vergence.__file__).parent
DOCS = Path(__file__).parents[2] / "docs"
API = DOCS / "reference" / "api"
KEY = re.compile(r"\[([A-Z][A-Za-z]+(?:19|20)\d\d[a-z]?)\]")
UNVERIFIED = {"Mezouar2001"}  # whose DOI could not be looked up
ENTRY = re.compile(r"^\(([A-Z]\w+)\)=\n(.*?)(?=^\(|\Z)", re.MULTILINE | re.DOTALL)


def cited_keys() -> dict[str, str]:
    """Key, and a file that cites it."""
    files = [*SOURCE.rglob("*.py"), *DOCS.rglob("*.md"), DOCS.parent / "README.md"]
    return {key: file.name for file in files for key in KEY.findall(file.read_text())}


def test_every_cited_key_has_an_entry_with_its_doi():
    entries = dict(ENTRY.findall((DOCS / "references.md").read_text()))
    cited = cited_keys()
    assert {key: file for key, file in cited.items() if key not in entries} == {}
    assert sorted(entries) == sorted(cited), "an entry that nobody cites"
    for key, text in entries.items():
        verified = re.search(r"https://doi\.org/10\.\d{4,}/\S+|has no DOI", text)
        assert verified or key in UNVERIFIED, key


def rooms() -> list[str]:
    return sorted(path.parent.name for path in SOURCE.glob("*/__init__.py"))


@pytest.mark.parametrize("room", sorted({*rooms()} - {"app", "kernels"}))
def test_every_room_is_in_the_api(room):
    assert f"automodule:: vergence.{room}\n" in (API / f"{room}.md").read_text()
    assert f"api/{room}\n" in (API.parent / "api.md").read_text()


@pytest.mark.parametrize("name", vergence.__all__)
def test_every_public_name_is_described_on_one_page_and_listed_with_its_meaning(name):
    pages = "".join(page.read_text() for page in API.glob("*.md"))
    module = described(name).removesuffix(f".{name}")
    assert f"automodule:: {module}\n" in pages or f":: {module}.{name}\n" in pages
    assert getattr(import_module(module), name) is getattr(vergence, name)
    assert f"`{name} <{module}.{name}>` | {meaning(name)[:10]}" in "\n".join(public_names())
    assert meaning(name).endswith(".")


def test_every_key_of_a_cell_file_says_what_it_means():
    assert "`view_margin_px`" in "".join(reference())  # it raises where a comment is missing


def test_ranges_of_a_cell_file_are_written_in_words():
    text = "".join(reference())
    for words in ("number above 0 and at most 100", "3 × number −1000 to 1000", "1e-6 to 1000"):
        assert words in text
    assert not re.search("[≥≤]|e[-+]0", text)


def test_every_table_of_a_cell_file_has_a_section_with_its_keys():
    sections = "\n".join(reference()).split("\n## ")
    rows = re.compile(r"^\| `(\w+)` \|", re.MULTILINE)
    shown = [set(rows.findall(text)) - {"kind"} for text in sections]
    made_of = ("Table", "TaskTable")  # what others are made of
    for name in schema.__all__:
        if name.endswith("Table") and name not in made_of:
            keys = set(getattr(schema, name).model_fields)
            assert keys - {"kind"} in shown, name


def test_options_that_a_command_mentions_are_code():
    """Text in which two hyphens are typeset as a dash cannot be copied."""
    text = re.sub(r"```.*?```|`[^`]*`", "", "\n".join(commands()), flags=re.DOTALL)
    assert "Instead of" in text
    assert [line for line in text.splitlines() if re.search(r"--[a-z]", line)] == []


def test_a_default_of_zero_is_shown():
    assert "| `--seed INT` | Random seed. | `0` |" in "\n".join(commands())


def test_a_command_lists_its_arguments_first_and_no_empty_default():
    for section in "\n".join(commands()).split("\n## "):
        rows = [line for line in section.splitlines() if line.startswith("| `")]
        options = [row.startswith("| `--") for row in rows]
        assert options == sorted(options), section.splitlines()[0]
        assert not any(row.endswith("| `` |") for row in rows)


def test_names_in_tables_break_after_underscores_and_dots_and_nowhere_else():
    page = new_document("page")
    names = [nodes.literal("", "law.optimal_tracking"), nodes.literal("", "0.5 s; a, b")]
    page += nodes.entry("", *names)
    page += nodes.literal("", "law.optimal_tracking")
    let_break(page)
    shown = ["".join(child.astext() for child in name) for name in page.findall(nodes.literal)]
    broken = "law.<wbr>optimal_<wbr>tracking"
    assert shown == [broken, "0.5 s; a, b", "law.optimal_tracking"]


def test_a_number_in_a_table_stays_beside_its_unit():
    page = new_document("page")
    told = ["0.85 px", "4 of 4", "-2.4e-05 m/s", "1.2 (1.1 ... 1.3)", "2 motions possible"]
    page += [nodes.entry("", nodes.paragraph("", text)) for text in told]
    page += nodes.paragraph("", "0.85 px")
    keep_together(page)
    kept = [text.replace(" ", "\u00a0") for text in told[:3]]
    assert [entry.astext() for entry in page.findall(nodes.entry)] == [*kept, *told[3:]]
    assert page.children[-1].astext() == "0.85 px"


def test_the_gallery_has_every_cell_with_its_image():
    shown = "\n".join(gallery())
    for name in built_in_cells():
        assert f"## {name}\n" in shown
        assert (DOCS / "images" / "cells" / f"{name}.jpg").is_file()


def pages() -> list[str]:
    """Return the pages that a reader may open first, as seen from the documentation's folder."""
    files = (path.relative_to(DOCS) for path in DOCS.rglob("*.md") if path.parent != API)
    return sorted(str(path) for path in files if not path.name.startswith("_"))


@pytest.mark.parametrize("page", [page for page in pages() if not page.startswith("_build")])
def test_the_first_screen_of_a_page_says_who_it_is_for_and_shows_an_image(page):
    first = (DOCS / page).read_text().splitlines()[:16]
    assert any(re.match(r"For [a-z]", line) for line in first), "who it is for"
    assert any(re.match(r"!\[.+\]\(.+\)|```\{gallery\}", line) for line in first), "an image"


@pytest.mark.parametrize("name", ["report.jpg", "track-report.jpg", "watch.jpg"])
def test_a_screenshot_has_a_dark_counterpart_of_its_size(name):
    light, dark = (cv2.imread(str(DOCS / folder / name)) for folder in ("images", "static/dark"))
    assert light.shape == dark.shape
    assert light[:, :8].mean() > 200
    assert dark[:, :8].mean() < 60
