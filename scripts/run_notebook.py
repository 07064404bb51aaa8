"""Run a notebook's cells and keep what they show: text, and figures as PNG.

    python scripts/run_notebook.py examples/notebook.ipynb

It needs no Jupyter, so the tests can run the notebook with what is installed anyway.
"""

import ast
import contextlib
import io
import json
import sys
from base64 import b64encode
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt


def run_notebook(notebook: dict[str, Any]) -> dict[str, Any]:
    """Return a notebook (format 4.5) with the outputs of its code cells; an exception escapes."""
    names: dict[str, object] = {"__name__": "__main__"}
    cells, count = [], 0
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            count += 1
            outputs = _outputs("".join(cell["source"]), names, count)
            cell = cell | {"execution_count": count, "outputs": outputs}
        cells.append(cell)
    return notebook | {"cells": cells}


def _outputs(source: str, names: dict[str, object], count: int) -> list[dict[str, Any]]:
    """Run a cell as Jupyter does: the value of a last expression is shown, as are figures."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    said, outputs = io.StringIO(), []
    with contextlib.redirect_stdout(said):
        exec(compile(tree, "notebook", "exec"), names)
        value = (
            eval(compile(ast.Expression(last.value), "notebook", "eval"), names) if last else None
        )
    if said.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": lines(said.getvalue())})
    if value is not None and not plt.get_fignums():
        data = {"text/plain": lines(repr(value))}
        result = {"output_type": "execute_result", "execution_count": count}
        outputs.append(result | {"data": data, "metadata": {}})
    for number in plt.get_fignums():
        png = io.BytesIO()
        plt.figure(number).savefig(png, dpi=70, bbox_inches="tight", metadata={"Software": None})
        data = {"image/png": b64encode(png.getvalue()).decode()}
        outputs.append({"output_type": "display_data", "data": data, "metadata": {}})
    plt.close("all")
    return outputs


def lines(text: str) -> list[str]:
    return text.splitlines(keepends=True)


def read_notebook(path: Path) -> dict[str, Any]:
    notebook: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return notebook


if __name__ == "__main__":
    path = Path(sys.argv[1])
    text = json.dumps(run_notebook(read_notebook(path)), indent=1, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
