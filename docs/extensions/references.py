"""Citations: [Nelson1995], in a page or a docstring, leads to its entry in references.md."""

import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

KEY = re.compile(r"\[([A-Z][A-Za-z]+[0-9]{4}[a-z]?)\](?!\()")
_ENTRY = re.compile(r"^\(([A-Z]\w+)\)=$", re.MULTILINE)


def entries(references: Path) -> list[str]:
    """Return the keys that have an entry, in order."""
    return _ENTRY.findall(references.read_text(encoding="utf-8"))


def _in_docstring(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    lines[:] = [
        KEY.sub(lambda found: f":ref:`[{found[1]}] <{found[1].lower()}>`", line) for line in lines
    ]


def _in_page(app: Sphinx, page: str, source: list[str]) -> None:
    """Say where a bracketed key leads, as Markdown's own reference links do."""
    cited = sorted(set(KEY.findall(source[0])))
    source[0] += "".join(f"\n\n[{key}]: #{key}" for key in cited)


def setup(app: Sphinx) -> dict[str, bool]:
    """Turn keys into links; one without an entry is a warning, and so an error."""
    app.connect("autodoc-process-docstring", _in_docstring, priority=120)
    app.connect("source-read", _in_page)
    return {"parallel_read_safe": True}
