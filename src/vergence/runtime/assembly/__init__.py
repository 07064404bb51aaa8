"""From a cell to the parts of its loop: one file a kind of task."""

from vergence.runtime.assembly.assemble import assemble_parts
from vergence.runtime.assembly.laws import build_law
from vergence.runtime.assembly.parts import Parts

__all__ = ["Parts", "assemble_parts", "build_law"]
