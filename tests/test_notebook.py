"""The notebook runs, and is kept with what it shows."""

from pathlib import Path

from run_notebook import read_notebook, run_notebook

NOTEBOOK = Path(__file__).parents[1] / "examples" / "notebook.ipynb"


def shown(notebook: dict) -> list[list[tuple[str, list[str]]]]:
    """Return, for each code cell, the kinds of its outputs and what they say."""
    return [
        [(output["output_type"], output.get("text", [])) for output in cell["outputs"]]
        for cell in notebook["cells"]
        if cell["cell_type"] == "code"
    ]


def test_the_notebook_runs_and_shows_what_is_kept_in_it() -> None:
    kept = read_notebook(NOTEBOOK)
    again = run_notebook(kept)
    assert shown(again) == shown(kept)
    assert all(shown(kept)), "a cell that shows nothing"
    images = [kind for cell in shown(kept) for kind, _ in cell if kind == "display_data"]
    assert len(images) == 4
