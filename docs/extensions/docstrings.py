"""How the docstrings of the code become pages: they are plain text, read as they stand."""

import re
import sys
from typing import Annotated, Any, get_args, get_origin

from sphinx.application import Sphinx
from sphinx.ext.napoleon.docstring import GoogleDocstring
from sphinx.util import typing

from vergence.field_comments import field_comments

_ARRAY = re.compile(r"~?numpy\.ndarray\[.*?~?numpy\.dtype\[~?numpy\.(\w+?)_?\]\]")
_LIKE_ARRAY = re.compile(r"~?[\w.]*_Buffer \| .*?_NestedSequence\[complex \| bytes \| str\]")
_NAMES = {
    "float64": "FloatArray",
    "int64": "IntArray",
    "bool": "BoolArray",
    "uint8": "ImageArray",
}
_DEFAULTS = (("<factory>", "..."), (re.compile(r"<class '(?:\w+\.)*(\w+)'>"), r"\1"))


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
    lines[:] = [
        "".join(
            part if part.startswith("`") else re.sub(r"([|*])", r"\\\1", part)
            for part in re.split(r"(`+[^`]*`+)", line)
        )
        for line in lines
    ]


def _short_signature(
    app: Sphinx,
    what: str,
    name: str,
    obj: Any,
    options: Any,
    signature: str | None,
    returns: str | None,
) -> tuple[str, str | None] | None:
    """Write defaults as code; a protocol is not constructed."""
    if signature is None:
        return None
    if what == "class" and getattr(obj, "_is_protocol", False):
        return "", None
    for old, new in _DEFAULTS:
        signature = re.sub(old, new, signature)
    return signature, returns


def _name_types() -> None:
    """Call types what the code calls them: no ranges of a number, no parts of an array."""
    own = typing.stringify_annotation

    def named(annotation: Any, /, *args: Any, **options: Any) -> str:
        if get_origin(annotation) is Annotated:
            return named(get_args(annotation)[0], *args, **options)
        text = _LIKE_ARRAY.sub("ArrayLike", own(annotation, *args, **options))
        return _ARRAY.sub(lambda found: _NAMES.get(found[1], found[0]), text)

    for module in list(sys.modules.values()):
        if getattr(module, "stringify_annotation", None) is own:
            module.stringify_annotation = named  # type: ignore[attr-defined]


def _whole_sentence(docstring: Any) -> tuple[str, list[str]]:
    """Take the words of an attribute before a colon for words, not for its type."""
    lines = docstring.__class__(docstring._consume_to_end(), docstring._config).lines()
    return "", lines


def _skip(app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Leave out what libraries add: "Alias for field number 0" of tuples, pydantic's members."""
    added = name in ("model_config", "model_post_init")
    return True if added or "Alias for field" in (getattr(obj, "__doc__", "") or "") else None


def setup(app: Sphinx) -> dict[str, bool]:
    """Hear of every docstring, before napoleon does."""
    _name_types()
    GoogleDocstring._consume_inline_attribute = _whole_sentence  # type: ignore[method-assign]
    app.connect("autodoc-process-docstring", _list_fields, priority=100)
    app.connect("autodoc-process-docstring", _as_plain_text, priority=110)
    app.connect("autodoc-process-signature", _short_signature)
    app.connect("autodoc-skip-member", _skip)
    return {"parallel_read_safe": True}
