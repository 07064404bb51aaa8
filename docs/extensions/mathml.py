"""Formulas as MathML, which browsers draw themselves: no script, no fonts, no network."""

import re
from html import unescape
from xml.etree import ElementTree as ET

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.writers.html5 import HTML5Translator

_NAMESPACE = ' xmlns="http://www.w3.org/1998/Math/MathML"'  # not needed within HTML
_ENTITY = re.compile(r"&(?!lt;|gt;|amp;|quot;|apos;)[A-Za-z]+;")  # HTML's, which XML does not know
_DOTS = ("˙", "¨")


def visit_math(self: HTML5Translator, node: nodes.Element) -> None:
    """Write a formula within a sentence."""
    self.body.append(_mathml(node.astext(), as_block=False))
    raise nodes.SkipNode


def visit_displaymath(self: HTML5Translator, node: nodes.Element) -> None:
    """Write a formula on a line of its own."""
    self.body.append(f'<div class="formula">{_mathml(node.astext(), as_block=True)}</div>')
    raise nodes.SkipNode


def _mathml(tex: str, as_block: bool) -> str:
    try:
        text = str(tex2mathml(tex, as_block=as_block))
    except MathError as error:
        raise ExtensionError(f"the formula {tex!r}: {error}") from None
    text = _ENTITY.sub(lambda entity: unescape(entity[0]), text.replace(_NAMESPACE, ""))
    root = ET.fromstring(text)
    for element in root.iter():
        _separate_dots(element)
    return ET.tostring(root, encoding="unicode")


def _separate_dots(element: ET.Element) -> None:
    """Put dots clear of their letter, and the index of a dotted letter beside it, not below.

    Without a mathematical font, browsers draw an accent into the letter.
    """
    if element.tag not in ("mover", "munderover") or element[-1].text not in _DOTS:
        return
    element.attrib.pop("accent", None)
    if element.tag == "munderover":
        letter, index, dots = element
        dotted = ET.Element("mover")
        dotted.extend((letter, dots))
        element.tag = "msub"
        element[:] = [dotted, index]


def setup(app: Sphinx) -> dict[str, bool]:
    """Make it how formulas are written."""
    app.add_html_math_renderer("mathml", (visit_math, None), (visit_displaymath, None))
    app.config.html_math_renderer = "mathml"
    return {"parallel_read_safe": True}
