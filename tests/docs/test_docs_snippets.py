"""Every snippet of the documentation runs, in order, in an empty folder.

A block with a caption is a file, as is a captioned file of the project that a page shows; or the
caption says how a command ends. A `text` block after another is what
that one prints, where `…` stands for anything.
"""

import contextlib
import io
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from markdown_it import MarkdownIt

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(path for path in DOCS.rglob("*.md") if "_build" not in path.parts)
SHOWN_ONLY = {"{literalinclude}", "{toctree}", "{eval-rst}", "{cell-file}", "{command-line}"}
SHOWN_ONLY |= {"{figure}", "{image}", "{note}", "{checks}", "{include}"}


class Block(NamedTuple):
    """A fenced block of a page."""

    language: str
    caption: str
    text: str
    line: int


def blocks(page: Path) -> Iterator[Block]:
    for token in MarkdownIt().parse(page.read_text(encoding="utf-8")):
        if token.type != "fence":
            continue
        directive, _, language = token.info.strip().rpartition(" ")
        if directive == "{literalinclude}" and (
            name := re.search(r":caption: (.*)", token.content)
        ):
            assert token.map
            shown = (page.parent / language).read_text(encoding="utf-8")
            yield Block("python", name[1], shown, token.map[0] + 1)
        if language in SHOWN_ONLY or directive in SHOWN_ONLY:
            continue
        assert directive in ("", "{code-block}"), f"{page.name}: {token.info} is not known"
        options = re.match(r"(?::\w+:.*\n)*\n?", token.content) if directive else None
        head = options[0] if options else ""
        caption = re.search(r":caption: (.*)", head)
        text = token.content[len(head) :]
        assert token.map
        yield Block(language, caption[1] if caption else "", text, token.map[0] + 1)


def run_python(block: Block, names: dict[str, object], page: Path) -> str:
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(compile("\n" * block.line + block.text, str(page), "exec"), names)
    return said.getvalue()


def run_shell(block: Block) -> str:
    ending = re.fullmatch(r"ends with exit code (\d)", block.caption)
    run = subprocess.run(
        ["bash", "-e", "-o", "pipefail", "-c", block.text],
        env=os.environ
        | {
            "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
            "PYTHONPATH": str(DOCS.parent / "src"),
            "COLUMNS": "120",
        },
        capture_output=True,
        text=True,
    )
    said = run.stdout + run.stderr
    assert run.returncode == (int(ending[1]) if ending else 0), f"line {block.line}:\n{said}"
    return said


def assert_prints(shown: str, said: str, where: str) -> None:
    lines = iter(re.sub(r"\s+", " ", line).strip() for line in said.splitlines())
    for wanted in filter(None, (re.sub(r"\s+", " ", line).strip() for line in shown.splitlines())):
        pattern = ".*".join(re.escape(part) for part in wanted.split("…"))
        assert any(re.fullmatch(pattern, line) for line in lines), f"{where}: {wanted}\n{said}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(DOCS).as_posix())
def test_every_snippet_of_a_page_runs_and_prints_what_the_page_says(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "__main__"}
    said = ""
    for block in blocks(page):
        if block.language == "text":
            assert_prints(block.text, said, f"line {block.line}")
        elif block.language == "sh":
            said = run_shell(block)
        elif block.caption:
            Path(block.caption).parent.mkdir(parents=True, exist_ok=True)
            Path(block.caption).write_text(block.text)
        else:
            assert block.language == "python", f"line {block.line}: {block.language}"
            said = run_python(block, names, page)
