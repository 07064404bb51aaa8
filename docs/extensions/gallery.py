"""The directive ``gallery``: every built-in cell, what it shows, its image and its commands."""

from collections.abc import Iterator

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from vergence.places import built_in_cells, cell_description


class Gallery(SphinxDirective):
    """Write a section for each cell."""

    def run(self) -> list[nodes.Node]:
        """Return the sections."""
        return self.parse_text_to_nodes("\n".join(gallery()), allow_section_headings=True)


def gallery() -> Iterator[str]:
    """Yield the lines of the gallery, in Markdown."""
    for name in built_in_cells():
        yield from (f"## {name}", "", cell_description(name), "")
        yield from (f"![{name}: from outside, and through the camera](images/cells/{name}.jpg)", "")
        yield from (f"`vergence watch {name}` · `vergence run {name}`", "")


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive."""
    app.add_directive("gallery", Gallery)
    return {"parallel_read_safe": True}
