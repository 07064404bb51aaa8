"""Writing a study's figures."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vergence.drawing import save
from vergence.studies.check import Figure


def save_figures(out: Path, drawn: Mapping[str, tuple[Any, str]]) -> tuple[Figure, ...]:
    """Write figures into a folder, in their order.

    Args:
        out: the folder; made if it is not there.
        drawn: file name without its ending to drawing and caption.
    """
    out.mkdir(parents=True, exist_ok=True)
    files = []
    for name, (drawing, caption) in drawn.items():
        path = out / f"{name}.svg"
        save(drawing, path)
        files.append(Figure(path, caption, drawing))
    return tuple(files)
