"""The same cell in simulation and over a robot's protocol: final error, and features lost.

.drivers/NAME/bin/python benchmarks/protocols.py NAME    (make test-drivers makes the environment)
python benchmarks/protocols.py socket

NAME is franka, ros2, so101, socket or ur. The robot is the one of the driver's tests, in a process
of its own, with a camera whose images are rendered from where its arm is. It keeps real time, so a
busy computer makes the figures worse; the load is told beside them.
"""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from vergence.assembly import run_cell, run_driver
from vergence.assembly.open_driver import equipment, open_driver
from vergence.cell import Cell, load_cell
from vergence.drivers import Equipment
from vergence.runtime import Driver, Run

ROOT = Path(__file__).parents[1]
RUNS, LAST = 3, 10  # runs over the protocol, and images at the end whose error is taken
SOCKET = {
    "target.motion": '{ kind = "stationary" }',
    "task.desired": '"centred"',
    "inner_rate_hz": "250",
    "cameras.wrist.rate_hz": "15",
    "duration_s": "6",
}
UR = {"target.motion": '{ kind = "stationary" }', "task.desired": '"centred"', "duration_s": "6"}


def seeing(cell: Cell, camera: Any, rate_hz: float) -> Equipment:
    at = equipment(cell)
    return Equipment("", at.arms, at.cameras, rate_hz, at.watched, {cell.task.camera: camera})


@contextmanager
def ended(robot: Any) -> Iterator[Any]:
    try:
        yield robot
    finally:
        robot.process.kill()
        robot.process.communicate()


@contextmanager
def ur(cell: Cell) -> Iterator[Driver]:
    protocol, rendered = import_module("protocol_ur"), import_module("rendered")
    with ended(protocol.Robot()) as robot:
        made = protocol.Ur(robot.address, **protocol.BUSY)
        yield made.open(seeing(cell, rendered.Rendered(cell), 500.0))


@contextmanager
def franka(cell: Cell) -> Iterator[Driver]:
    protocol, camera = import_module("protocol_franka"), import_module("rendered").Rendered(cell)
    with ended(protocol.Robot()) as robot:
        driver = robot.open(seeing(cell, camera, protocol.RATE_HZ))
        camera.clocked_by(lambda: driver._reading.time)
        yield driver


@contextmanager
def so101(cell: Cell) -> Iterator[Driver]:
    protocol, camera = import_module("protocol_so101"), import_module("rendered").Rendered(cell)
    with ended(protocol.Servos()) as servos:
        yield servos.open(seeing(cell, camera, 100.0), rate_hz=20.0)


@contextmanager
def ros2(_: Cell) -> Iterator[Driver]:
    protocol = import_module("protocol_ros2")
    with ended(protocol.Robot(images="mono8", cell=["ur5", protocol.SETTINGS])) as robot:
        images = {"wrist": f"{robot.space}/wrist/image_raw"}
        yield robot.open(protocol.SEEING, images=images)


@contextmanager
def socket(cell: Cell) -> Iterator[Driver]:
    port = "5017"
    words = [sys.executable, "robot.py", "ur5", port, *(f"{k}={v}" for k, v in SOCKET.items())]
    folder = ROOT / "examples" / "hardware"
    with subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL) as robot:
        try:
            yield open_driver(cell, f"socket:localhost:{port}")
        finally:
            robot.kill()


MAKES: dict[str, Callable[[Cell], Any]] = {
    "franka": franka, "ros2": ros2, "so101": so101, "socket": socket, "ur": ur,
}  # fmt: skip


def cell_of(name: str) -> Cell:
    if name == "socket":
        return load_cell("ur5", SOCKET)
    if name == "ur":
        return load_cell("ur5", UR)
    cell: Cell = import_module(f"protocol_{name}").CELL
    return cell


def told(run: Run, camera: str) -> tuple[float, int, int]:
    """Return the final error, px, how many features were not found in an image, and of how many."""
    trace = run.cameras[camera]
    return float(np.nanmean(trace.error_px[-LAST:])), int((~trace.found).sum()), trace.found.size


def main(name: str) -> None:
    sys.path.insert(0, str(ROOT / "tests" / "drivers"))
    cell = cell_of(name)
    camera = cell.task.camera
    simulated = told(run_cell(cell), camera)
    runs = []
    for _ in range(RUNS):
        with MAKES[name](cell) as driver:
            run = run_driver(cell, driver, (), images=True)
            driver.close()
        runs.append((*told(run, camera), run.outcome.kind.value))
    errors = [error for error, *_ in runs]
    print(
        f"| `{name}` | `{cell.name}` | {simulated[0]:.2f} | "
        f"{np.median(errors):.2f} ({min(errors):.2f} to {max(errors):.2f}) | {simulated[1]} of "
        f"{simulated[2]} | {sum(r[1] for r in runs)} of {sum(r[2] for r in runs)} | "
        f"load {os.getloadavg()[0]:.1f}, {', '.join(sorted({r[3] for r in runs}))}"
    )


if __name__ == "__main__":
    main(sys.argv[1])
