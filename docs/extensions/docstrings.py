"""How the docstrings of the code become pages: they are plain text, read as they stand."""

import re
from typing import Any

from sphinx.application import Sphinx

from vergence.field_comments import field_comments

_ARRAY = re.compile(r"~?numpy\.ndarray\[.*?~?numpy\.dtype\[~?numpy\.(\w+?)_?\]\]")
_NAMES = {
    "float64": "FloatArray",
    "int64": "IntArray",
    "bool": "BoolArray",
    "uint8": "ImageArray",
}


def _list_fields(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    """Append a class's fields to its docstring, where that does not list them itself."""
    if what != "class" or any(re.match(r"(Attributes|Args):", line) for line in lines):
        return
    fields = {n: c for n, c in field_comments(obj).items() if c and not n.startswith("_")}
    if fields:
        lines += ["", "Fields:", *(f"    {name}: {said}" for name, said in fields.items())]


def _as_plain_text(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    """Keep |w| a magnitude and F* a name: neither is markup in our docstrings."""
    if what in ("property", "attribute"):
        lines.insert(0, "")  # else napoleon takes what stands before a colon for a type
    lines[:] = [
        "".join(
            part if part.startswith("`") else re.sub(r"([|*])", r"\\\1", part)
            for part in re.split(r"(`+[^`]*`+)", line)
        )
        for line in lines
    ]


def _name_arrays(
    app: Sphinx,
    what: str,
    name: str,
    obj: Any,
    options: Any,
    signature: str | None,
    returns: str | None,
) -> tuple[str, str | None] | None:
    """Call arrays what the code calls them."""
    if signature is None:
        return None
    return _named(signature), returns and _named(returns)


def _named(signature: str) -> str:
    return _ARRAY.sub(lambda found: _NAMES.get(found[1], found[0]), signature)


def _skip(app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Leave out what a NamedTuple says of its fields: "Alias for field number 0"."""
    return True if "Alias for field" in (getattr(obj, "__doc__", "") or "") else None


def setup(app: Sphinx) -> dict[str, bool]:
    """Hear of every docstring, before napoleon does."""
    app.connect("autodoc-process-docstring", _list_fields, priority=100)
    app.connect("autodoc-process-docstring", _as_plain_text, priority=110)
    app.connect("autodoc-process-signature", _name_arrays)
    app.connect("autodoc-skip-member", _skip)
    return {"parallel_read_safe": True}
