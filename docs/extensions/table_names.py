"""Names in tables may break after `_` and `.`, so that on a narrow screen no word is cut."""

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

_AFTER = re.compile(r"(?<=[A-Za-z\]][_.])(?=\w)")


def let_break(doctree: nodes.document) -> None:
    """Mark where names in the tables of a page may break."""
    for entry in doctree.findall(nodes.entry):
        for literal in entry.findall(nodes.literal):
            if any(not isinstance(child, nodes.Text) for child in literal.children):
                continue
            first, *others = _AFTER.split(literal.astext())
            literal.children = []
            literal += nodes.Text(first)
            for part in others:
                literal += nodes.raw("", "<wbr>", format="html")
                literal += nodes.Text(part)


def _resolved(app: Sphinx, doctree: nodes.document, page: str) -> None:
    let_break(doctree)


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.connect("doctree-resolved", _resolved)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
