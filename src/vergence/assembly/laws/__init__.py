"""From a cell's law to the law itself."""

from vergence.assembly.laws.build_law import build_law

__all__ = ["build_law"]
