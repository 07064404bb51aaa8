"""Every example runs from start to end, and says what it did."""

import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
from board_images import write_board_images

import vergence

EXAMPLES = Path(__file__).parents[1] / "examples"


def write_frames(folder: Path) -> None:
    """Write images of a texture that moves two pixels from one to the next."""
    texture = cv2.imread(str(Path(vergence.__file__).parent / "cells/puma560/leaves.png"), 0)
    for k in range(5):
        cv2.imwrite(str(folder / f"{k}.png"), np.roll(texture, 2 * k, axis=1)[:240, :320])


def test_every_example_runs_and_says_what_it_did(tmp_path: Path) -> None:
    for name, write in (("frames", write_frames), ("board", write_board_images)):
        (tmp_path / name).mkdir()
        write(tmp_path / name)
    for example in sorted(EXAMPLES.glob("*.py")):
        run = subprocess.run(
            [sys.executable, "-W", "error", str(example)],
            cwd=tmp_path,
            env={"MUJOCO_GL": "egl", "MPLBACKEND": "Agg"} | os.environ,
            capture_output=True,
            text=True,
        )
        assert run.returncode == 0, f"{example.name}:\n{run.stderr}"
        assert run.stdout, example.name


def test_an_example_is_short_enough_to_be_read() -> None:
    scripts = sorted(EXAMPLES.rglob("*.py"))
    assert len(scripts) >= 12
    for script in scripts:
        assert len(script.read_text(encoding="utf-8").splitlines()) <= 100, script.name
