"""`make footage` reads ViSP's models and counts what is said, the missing peer included."""

from pathlib import Path

import numpy as np

from footage_rows import Row, markdown, missing
from real_images import CUBE, IMAGES, PACKAGE, read_cao, read_grey
from vergence.vision.board import Board


def test_a_model_of_visp_is_read_with_the_parts_it_names(tmp_path: Path) -> None:
    square = "V1\n4\n0 0 0 # first\n1 0 0\n1 1 0\n0 1 0\n0\n0\n1\n4 0 1 2 3 name=top\n0\n0\n"
    (tmp_path / "part.cao").write_text(square)
    (tmp_path / "all.cao").write_text('V1\nload("part.cao")\n0\n0\n0\n0\n0\n0\n')
    model = read_cao(tmp_path / "all.cao")
    assert len(model.triangles) == 2
    assert len(model.edges) == 4


def test_a_table_shows_who_is_missing_and_which_aim_fails() -> None:
    rows = [
        Row("tags", "dark", "vergence", 12, 9, 1, 2, 0.25, "px", 1.3, "never wrong", False),
        missing("tags", "dark", "ViSP is not installed"),
    ]
    text = markdown(rows)
    assert (
        "| dark | vergence | 12 | 9 | 1 | 2 | 0.25 px | 1.3 | never wrong: **does not hold** |"
        in text
    )
    assert "|  | ViSP is not installed | | | | | | | |" in text


def test_a_real_board_of_circles_is_found_in_its_order_in_any_light() -> None:
    assert IMAGES.is_dir(), f"{PACKAGE} is missing"
    assert len(CUBE.model.edges) == 12
    board = Board(6, 6, 0.03, pattern="circles")
    for path in sorted((IMAGES / "calibration").glob("grid36-*.pgm")):
        image = read_grey(path)
        bright, dark = (board.find(each, path.name) for each in (image, image // 8))
        assert bright is not None
        assert dark is not None
        steps = np.diff(bright.points_px.reshape(6, 6, 2), axis=1)
        lengths = np.linalg.norm(steps, axis=2)
        assert lengths.max() < 2.0 * lengths.min()
        apart = np.linalg.norm(bright.points_px[:, None] - dark.points_px, axis=2)
        assert apart.min(axis=1).max() < 0.5
