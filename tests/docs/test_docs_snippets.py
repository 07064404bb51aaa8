"""Every snippet of the documentation runs, in order, in an empty folder.

A block with a caption is a file, as is a captioned file of the project that a page shows; or the
caption says how a command ends. A `text` block after another is what
that one prints, where `…` stands for anything.
"""

import contextlib
import io
import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from markdown_it import MarkdownIt

from vergence.app.main import main

DOCS = Path(__file__).parents[2] / "docs"
README = DOCS.parent / "README.md"
PAGES = [README, *sorted(path for path in DOCS.rglob("*.md") if "_build" not in path.parts)]
SHOWN_ONLY = {
    "{literalinclude}",
    "{toctree}",
    "{eval-rst}",
    "{cell-file}",
    "{command-line}",
    "{gallery}",
    "{public-names}",
}
SHOWN_ONLY |= {"{figure}", "{image}", "{note}", "{checks}", "{include}", "{gallery}"}
SHOWN_ONLY |= {"console"}  # commands that need a robot


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
    """Run a block: a command of ours in this process, which spares its start, else by a shell."""
    if block.caption == "runs until Ctrl-C":
        return run_until_it_runs(block.text)
    ending = re.fullmatch(r"ends with exit code (\d)", block.caption)
    text = block.text.replace("\\\n", " ")
    plain = text.startswith("vergence ") and not re.search(r"[$|&;<>]|\n.", text)
    code, said = run_command(shlex.split(text)) if plain else run_in_shell(text)
    assert code == (int(ending[1]) if ending else 0), f"line {block.line}:\n{said}"
    return said


def run_command(words: list[str]) -> tuple[int, str]:
    said, code = io.StringIO(), None
    with (
        pytest.MonkeyPatch.context() as patch,
        contextlib.redirect_stdout(said),
        contextlib.redirect_stderr(said),
    ):
        patch.setattr(sys, "argv", words)
        try:
            main()
        except SystemExit as end:
            code = end.code
    return (code if isinstance(code, int) else 0), said.getvalue()


def run_in_shell(text: str) -> tuple[int, str]:
    command = ["bash", "-e", "-o", "pipefail", "-c", text]
    run = subprocess.run(
        command, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    return run.returncode, run.stdout


def run_until_it_runs(text: str) -> str:
    """Start a command that serves until it is stopped; stop it once it says how."""
    command = ["bash", "-c", f"exec {text}"]
    with subprocess.Popen(
        command, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as run:
        assert run.stdout
        said = ""
        for line in run.stdout:
            said += line
            if "Ctrl-C" in line:
                run.send_signal(signal.SIGINT)
    assert run.returncode == 0, said
    return said


def environment() -> dict[str, str]:
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    ours = {"PATH": path, "PYTHONPATH": str(DOCS.parent / "src"), "PYTHONUNBUFFERED": "1"}
    return os.environ | ours | {"BROWSER": "true"}  # opens nothing


def assert_prints(shown: str, said: str, where: str) -> None:
    lines = iter(re.sub(r"\s+", " ", line).strip() for line in said.splitlines())
    for expected in filter(
        None, (re.sub(r"\s+", " ", line).strip() for line in shown.splitlines())
    ):
        pattern = ".*".join(re.escape(part) for part in expected.split("…"))
        assert any(re.fullmatch(pattern, line) for line in lines), f"{where}: {expected}\n{said}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(DOCS.parent).as_posix())
def test_every_snippet_of_a_page_runs_and_prints_what_the_page_says(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "__main__"}
    said = ""
    for block in blocks(page):
        if block.language == "text" and not block.caption:
            assert_prints(block.text, said, f"line {block.line}")
        elif block.language == "sh":
            said = run_shell(block)
        elif block.caption:
            Path(block.caption).parent.mkdir(parents=True, exist_ok=True)
            Path(block.caption).write_text(block.text)
        else:
            assert block.language == "python", f"line {block.line}: {block.language}"
            said = run_python(block, names, page)
