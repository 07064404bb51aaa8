"""What the first commands cost after `pip install` of the wheel: CPU time; no kernel is compiled.

The newest wheel in `dist/` is installed into a bare environment (`make test-wheel` builds it), and
every command runs there for the first time, in a folder that is empty.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from harness import measured
from real_images import CUBE, IMAGES, INSTALL

PROJECT = Path(__file__).parents[1]
COUNT = PROJECT / "scripts" / "count_compilations.py"
NO_WHEEL = "no wheel in dist/ (make test-wheel)"
SECONDS = "duration_s=2"
COMMANDS = {
    "run puma560": ("run", "puma560", "--set", SECONDS),
    "run ur5": ("run", "ur5", "--set", SECONDS),
    "run lippiello2005, which follows": ("run", "lippiello2005", "--set", SECONDS),
    "plan gantry": ("plan", "gantry"),
}
AIM_S = 5.0
OF_NUMBA = ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_CACHE_DIR")  # the wheel has its own


def first_commands() -> dict[str, tuple[str, ...] | None]:
    """The commands, by what they do; None where what they need is not installed."""
    return {**COMMANDS, "track a cube": track_command() if IMAGES.is_dir() else None}


def track_command() -> tuple[str, ...]:
    """Follow the cube of Debian's real images, with a camera and a pose as a user writes them."""
    folder, camera, model = Path(tempfile.mkdtemp()), CUBE.camera, CUBE.model
    lines = ["v {} {} {}".format(*vertex) for vertex in model.vertices]
    lines += ["f {} {} {}".format(*triangle + 1) for triangle in model.triangles]
    (folder / "cube.obj").write_text("\n".join(lines) + "\n")
    start = {"T_camera_target": CUBE.first_pose().tolist()}
    (folder / "start.json").write_text(json.dumps(start))
    lens = {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy}
    return (
        "track",
        str(IMAGES / CUBE.folder),
        "--model",
        str(folder / "cube.obj"),
        "--start",
        str(folder / "start.json"),
        "--rate",
        "25",
        *(word for name, value in lens.items() for word in (f"--{name}", str(value))),
    )


def installed(wheel: Path, folder: Path) -> Path:
    """Install the wheel into a bare environment; return its Python."""
    base = getattr(sys, "_base_executable", sys.executable)
    subprocess.run([base, "-m", "venv", folder], check=True)
    python = folder / "bin" / "python"
    pip = (python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check")
    constraints = ("--constraint", PROJECT / "constraints.txt")
    subprocess.run([*pip, *constraints, f"{wheel}[arms]"], check=True, stdout=subprocess.DEVNULL)
    return python


def cost(python: Path, command: tuple[str, ...]) -> tuple[float, int]:
    """Return the CPU seconds of a command, and how many kernels it compiled."""
    bare = {key: value for key, value in os.environ.items() if key not in (*OF_NUMBA, "PYTHONPATH")}
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [python, COUNT, *command], cwd=folder, env=bare, capture_output=True, text=True
        )
    kernels = re.search(r"^kernels compiled: (\d+)", done.stdout, re.MULTILINE)
    cpu_s = re.search(r"^CPU: ([\d.]+) s", done.stdout, re.MULTILINE)
    if kernels is None or cpu_s is None:
        raise RuntimeError(f"{' '.join(command)}: {done.stdout}{done.stderr}")
    return float(cpu_s[1]), int(kernels[1])


def run() -> list[dict[str, Any]]:
    name = "first run from the wheel: {}"
    wheels = sorted(
        (PROJECT / "dist").glob("vergence-*.whl"), key=lambda path: path.stat().st_mtime
    )
    if not wheels:
        missing = measured(name.format("all"), float("nan"), "s", at_most=AIM_S)
        return [missing | {"peer": NO_WHEEL}]
    rows, compiled = [], 0
    with tempfile.TemporaryDirectory() as folder:
        python = installed(wheels[-1], Path(folder) / "bare")
        for words, command in first_commands().items():
            if command is None:
                absent = measured(name.format(words), float("nan"), "s", at_most=AIM_S)
                rows.append(absent | {"peer": INSTALL})
                continue
            cpu_s, kernels = cost(python, command)
            compiled += kernels
            rows.append(measured(name.format(words), cpu_s, "s", at_most=AIM_S))
    return [*rows, measured(name.format("kernels compiled"), compiled, "", at_most=0)]
