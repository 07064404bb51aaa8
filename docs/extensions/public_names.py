"""The directive ``public-names``: what `import vergence` offers, and where it is described."""

import inspect
import re
from collections.abc import Iterator
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import vergence

_PAGES = Path(__file__).parents[1] / "reference" / "api"
_ALIASES = {"Positive": "A number above zero, as the type of a field."}


class PublicNames(SphinxDirective):
    """Write a table of all public names."""

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        return self.parse_text_to_nodes("\n".join(reference()))


def reference() -> Iterator[str]:
    """Yield the lines of the table, in Markdown."""
    yield from ("", "| name | what it is or does |", "| --- | --- |")
    for name in sorted(vergence.__all__, key=lambda name: (name[0].isupper(), name.lower())):
        told = meaning(name).replace("|", r"\|")
        yield f"| {{py:obj}}`{name} <{described(name)}>` | {told} |"
    yield ""


def meaning(name: str) -> str:
    """Return what a public name is, in one line without the line's code."""
    text = _ALIASES.get(name) or inspect.getdoc(getattr(vergence, name)) or ""
    return re.sub(r"`+", "", text.splitlines()[0])


def described(name: str) -> str:
    """Return the full name under which the pages describe a public name.

    Raises:
        LookupError: if no page does.
    """
    pages = "\n".join(page.read_text(encoding="utf-8") for page in sorted(_PAGES.glob("*.md")))
    if own := re.search(rf":: (vergence\.[\w.]+\.{name})$", pages, re.MULTILINE):
        return own[1]
    made_in = f"{getattr(vergence, name).__module__}."
    modules = re.findall(r"automodule:: ([\w.]+)$", pages, re.MULTILINE)
    around = [module for module in modules if made_in.startswith(f"{module}.")]
    if not around:
        raise LookupError(f"no page of the API describes vergence.{name}")
    return f"{max(around, key=len)}.{name}"


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive."""
    app.add_directive("public-names", PublicNames)
    return {"parallel_read_safe": True}
