"""The same cell in simulation and over a robot's protocol: final error, and features lost.

.drivers/NAME/bin/python benchmarks/protocols.py NAME [--moving]    (after make test-drivers)
python benchmarks/protocols.py socket [--moving]

NAME is franka, ros2, so101, socket or ur. With --moving the target goes round a circle, and the
error is the root mean square of the second half. The robot is the one of the driver's tests, in a
process of its own, with a camera whose images are rendered from where its arm is. It keeps real
time, so a busy computer makes the figures worse; the load is told beside them.
"""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
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
ROUND_M = {"so101": 0.004}  # radius of the circle: its arm is slow
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
def ur(cell: Cell, _: Mapping[str, str]) -> Iterator[Driver]:
    protocol, rendered = import_module("protocol_ur"), import_module("rendered")
    with ended(protocol.Robot()) as robot:
        made = protocol.Ur(robot.address, **protocol.BUSY)
        yield made.open(seeing(cell, rendered.Rendered(cell), 500.0))


@contextmanager
def franka(cell: Cell, _: Mapping[str, str]) -> Iterator[Driver]:
    protocol, camera = import_module("protocol_franka"), import_module("rendered").Rendered(cell)
    with ended(protocol.Robot()) as robot:
        driver = robot.open(seeing(cell, camera, protocol.RATE_HZ))
        camera.clocked_by(lambda: driver._reading.time)
        yield driver


@contextmanager
def so101(cell: Cell, _: Mapping[str, str]) -> Iterator[Driver]:
    protocol, camera = import_module("protocol_so101"), import_module("rendered").Rendered(cell)
    with ended(protocol.Servos()) as servos:
        yield servos.open(seeing(cell, camera, 100.0), rate_hz=20.0)


@contextmanager
def ros2(_: Cell, settings: Mapping[str, str]) -> Iterator[Driver]:
    protocol = import_module("protocol_ros2")
    with ended(protocol.Robot(images="mono8", cell=["ur5", settings])) as robot:
        images = {"wrist": f"{robot.space}/wrist/image_raw"}
        yield robot.open(protocol.SEEING, images=images)


@contextmanager
def socket(cell: Cell, settings: Mapping[str, str]) -> Iterator[Driver]:
    port = "5017"
    words = [sys.executable, "robot.py", "ur5", port, *(f"{k}={v}" for k, v in settings.items())]
    folder = ROOT / "examples" / "hardware"
    with subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL) as robot:
        try:
            yield open_driver(cell, f"socket:localhost:{port}")
        finally:
            robot.kill()


MAKES: dict[str, Callable[[Cell, Mapping[str, str]], Any]] = {
    "franka": franka, "ros2": ros2, "so101": so101, "socket": socket, "ur": ur,
}  # fmt: skip


def settings_of(name: str, moving: bool) -> tuple[str, Mapping[str, str]]:
    """Return the cell that a robot is tried with, and what is set in it."""
    cell, settings = {"socket": ("ur5", SOCKET), "ur": ("ur5", UR)}.get(name, ("", {}))
    if not cell:
        protocol = import_module(f"protocol_{name}")
        cell, settings = protocol.CELL.name, protocol.SETTINGS
    if moving:
        motion = f'{{ kind = "circle", radius_m = {ROUND_M.get(name, 0.02)}, period_s = 8 }}'
        settings = {**settings, "target.motion": motion, "duration_s": "16"}
    return cell, settings


def told(run: Run, camera: str, moving: bool) -> tuple[float, int, int]:
    """Return the error, px, how many features were not found in an image, and of how many."""
    trace = run.cameras[camera]
    error = trace.error_px[len(trace.error_px) // 2 :]
    final = np.sqrt(np.nanmean(error**2)) if moving else np.nanmean(error[-LAST:])
    return float(final), int((~trace.found).sum()), trace.found.size


def main(name: str, moving: bool) -> None:
    sys.path.insert(0, str(ROOT / "tests" / "drivers"))
    cell_name, settings = settings_of(name, moving)
    cell = load_cell(cell_name, settings)
    camera = cell.task.camera
    simulated = told(run_cell(cell), camera, moving)
    runs = []
    for _ in range(RUNS):
        with MAKES[name](cell, settings) as driver:
            run = run_driver(cell, driver, (), images=True)
            driver.close()
        runs.append((*told(run, camera, moving), run.outcome.kind.value))
    errors = [error for error, *_ in runs]
    print(
        f"| `{name}` | `{cell.name}` | {simulated[0]:.2f} | "
        f"{np.median(errors):.2f} ({min(errors):.2f} to {max(errors):.2f}) | {simulated[1]} of "
        f"{simulated[2]} | {sum(r[1] for r in runs)} of {sum(r[2] for r in runs)} | "
        f"load {os.getloadavg()[0]:.1f}, {', '.join(sorted({r[3] for r in runs}))}"
    )


if __name__ == "__main__":
    main(sys.argv[1], "--moving" in sys.argv[2:])
