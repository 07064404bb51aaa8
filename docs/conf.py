"""How the documentation is built: `make docs`. Nothing is fetched, and a warning is an error."""

import os
import re
import sys
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "extensions"), str(HERE.parent / "src")]
os.environ["NUMBA_DISABLE_JIT"] = "1"  # a kernel is documented as the function it was written as

project = "vergence"
author = "the vergence authors"
release = version = version_of("vergence")
project_copyright = "the vergence authors, under the Apache License 2.0"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "cell_file",
    "command_line",
    "docstrings",
    "gallery",
    "mathml",
    "public_names",
    "references",
    "table_names",
]
exclude_patterns = ["_build", "extensions", "**/_*.md"]  # what begins with _ is included

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

default_role = "py:obj"
add_module_names = False
python_use_unqualified_type_names = True
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
python_maximum_signature_line_length = 88
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "imported-members": True}
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_custom_sections = [("Fields", "params_style")]

html_theme = "furo"
html_title = "vergence"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"top_of_page_buttons": []}


def setup(app: Sphinx) -> None:
    """Make of pages what a keyboard and a screen reader can use."""
    app.connect("html-page-context", _accessible, priority=900)  # after the theme's
    app.connect("html-page-context", _dark_images)


def _dark_images(_app: Sphinx, _page: str, _template: str, context: Any, _doctree: Any) -> None:
    """Add to each screenshot that has one its dark counterpart; the theme shows one of them."""
    path_to = context["pathto"]

    def both(image: re.Match[str]) -> str:
        name = image["name"]
        if not (HERE / "static" / "dark" / name).is_file():
            return image[0]
        dark = path_to(f"_static/dark/{name}", resource=True)
        shown = f'<img class="only-light" alt={image["alt"]} src="{image["folder"]}{name}" />'
        return f'{shown}<img class="only-dark" alt={image["alt"]} src="{dark}" />'

    image = r'<img alt=(?P<alt>"[^"]*") src="(?P<folder>[^"]*_images/)(?P<name>[^"/]+)" />'
    context["body"] = re.sub(image, both, context.get("body", ""))


def _accessible(*about: Any) -> None:
    """Give headings their level, code that scrolls the focus, and empty headings of tables none."""
    context = about[3]
    for part, old, new in (
        ("furo_navigation_tree", 'role="heading"', 'role="heading" aria-level="2"'),
        ("body", "<pre>", '<pre tabindex="0">'),
        ("body", '<th class="head"><p></p></th>', "<td></td>"),
    ):
        context[part] = context.get(part, "").replace(old, new)
