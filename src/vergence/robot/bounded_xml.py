"""XML files from untrusted sources, read within bounds."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TypeAlias, cast
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element

from vergence.errors import Absent, InputError

_Events: TypeAlias = Iterator[tuple[str, Element]]
_BYTES_MAX = 16 << 20
_DEPTH_MAX = 256
_ELEMENTS_MAX = 100_000
_DIGITS_MAX = 64  # digits in one number
_LARGEST = 1e18  # largest magnitude of a number


def read_xml(path: Path) -> Element:
    """Return the root of an XML file.

    Raises:
        InputError: if it cannot be read, is not XML, declares entities, or exceeds the bounds.
    """
    source = str(path)
    try:
        size = path.stat().st_size
        text = path.read_bytes() if size <= _BYTES_MAX else b""
    except OSError as error:
        raise InputError(
            source, "", error.strerror or Absent("no file"), "a file to read"
        ) from None
    if size > _BYTES_MAX:
        raise InputError(source, "", f"{size} bytes", f"at most {_BYTES_MAX >> 20} MB")
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise InputError(source, "", "a document type with entities", "XML without <!DOCTYPE")
    return _parse(text, source)


def _parse(text: bytes, source: str) -> Element:
    parser: ET.XMLPullParser[Element] = ET.XMLPullParser(("start", "end"))
    root: Element | None = None
    depth = count = 0
    try:
        for begin in range(0, len(text), _DEPTH_MAX):
            parser.feed(text[begin : begin + _DEPTH_MAX])
            for event, element in cast("_Events", parser.read_events()):
                root = element if root is None else root
                depth += 1 if event == "start" else -1
                count += event == "start"
                if depth > _DEPTH_MAX:
                    raise InputError(source, "", "nested elements", f"{_DEPTH_MAX} levels at most")
                if count > _ELEMENTS_MAX:
                    raise InputError(source, "", "too many elements", f"{_ELEMENTS_MAX} at most")
        parser.close()
    except (ET.ParseError, LookupError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(source, "", f"incomplete or not XML ({error})", "XML") from None
    if root is None:
        raise InputError(source, "", Absent("no element"), "XML")
    return root


def numbers(
    element: Element, key: str, default: tuple[float, ...], source: str, where: str
) -> tuple[float, ...]:
    """Return the numbers of an attribute, as many as the default has.

    Args:
        element: the element that may have the attribute.
        key: the attribute.
        default: returned if the attribute is absent.
        source: the file, for error messages.
        where: the element, for error messages.

    Raises:
        InputError: if there is another number of values, or one is not finite.
    """
    given = element.get(key)
    if given is None:
        return default
    words = given.split()
    try:
        if len(words) != len(default) or any(len(word) > _DIGITS_MAX for word in words):
            raise ValueError
        values = tuple(float(word) for word in words)
        if not all(math.isfinite(value) and abs(value) <= _LARGEST for value in values):
            raise ValueError
    except ValueError:
        shown = given if len(given) < _DIGITS_MAX else given[:_DIGITS_MAX] + "…"
        count = "a number" if len(default) == 1 else f"{len(default)} numbers"
        allowed = f"{count} between {-_LARGEST:g} and {_LARGEST:g}"
        raise InputError(source, f"{where}: {key}", shown, allowed) from None
    return values
