"""Lines in tables: names may break after `_` and `.`, and a number stays beside its unit."""

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

_AFTER = re.compile(r"(?<=[A-Za-z\]][_.])(?=\w)")
_QUANTITY = re.compile(r"-?[\d.]+(e[-+]?\d+)? (\S{1,4}|of \d+)")  # "0.85 px", "4 of 4"


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


def keep_together(doctree: nodes.document) -> None:
    """Keep numbers in the tables of a page on the line of their units."""
    for entry in doctree.findall(nodes.entry):
        if _QUANTITY.fullmatch(entry.astext()):
            for text in list(entry.findall(nodes.Text)):
                text.parent.replace(text, nodes.Text(text.replace(" ", "\u00a0")))


def _resolved(app: Sphinx, doctree: nodes.document, page: str) -> None:
    let_break(doctree)
    keep_together(doctree)


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.connect("doctree-resolved", _resolved)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
