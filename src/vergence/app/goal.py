"""`vergence goal`: take a photograph to go back to."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vergence.app.output import FAILURE, SUCCESS, emit, say
from vergence.errors import InputError

if TYPE_CHECKING:
    from vergence.arrays import BoolArray, FloatArray
    from vergence.cell import Cell
    from vergence.runtime.driver import Driver
    from vergence.signals import Frame


class Request(NamedTuple):
    """What was asked for."""

    cell: str
    out: Path
    at: str | None  # joint positions, degrees, with commas; a simulation's alone
    distance_m: float | None
    settings: Sequence[str]
    driver: str | None


def goal(request: Request, as_json: bool) -> int:
    """Take the photograph and say where it is; return the exit code."""
    from vergence.app.run import overrides
    from vergence.assembly import open_driver
    from vergence.camera.photograph import write_photograph
    from vergence.cell import load_cell
    from vergence.errors import DriverSilent
    from vergence.simulation import SimulatedDriver
    from vergence.vision.matching import image_fault

    cell = load_cell(request.cell, overrides(request.settings))
    if request.driver is not None and request.at is not None:
        raise InputError("--at", "", request.at, "nothing with --driver: move the robot there")
    driver = open_driver(cell, request.driver) if request.driver else SimulatedDriver(cell)
    try:
        frame = _frame(cell, driver, request.at)
        camera = driver.cameras[cell.task.camera]
        sliding = {name: arm.sliding for name, arm in driver.arms.items()}
    except DriverSilent as silence:
        say(f"no photograph: {silence}")
        return FAILURE
    finally:
        driver.close()
    assert frame.image is not None
    joints = {arm: _in_degrees(q, sliding[arm]) for arm, q in frame.joints.items()}
    write_photograph(request.out, frame.image, camera, joints, request.distance_m)
    fault = image_fault(frame.image)
    if as_json:
        emit({"command": "goal", "cell": cell.name, "goal": request.out, "fault": fault or None})
        return SUCCESS
    say(f"goal  {request.out}, with its camera file and joints beside it")
    if fault:
        say(f"  beware: it is {fault}; nothing may be recognised in it")
    say(f"  next: vergence run {request.cell} --goal {shlex.quote(str(request.out))}")
    return SUCCESS


def _frame(cell: "Cell", driver: "Driver", at: str | None) -> "Frame":
    """Return an image of the task's camera: where the arm is, or at joint positions."""
    from vergence.assembly.started_driver import StartedDriver
    from vergence.cell.joint_positions import joint_positions
    from vergence.simulation import SimulatedDriver

    name = cell.task.camera
    if at is not None and isinstance(driver, SimulatedDriver):
        try:
            given = [float(number) for number in at.split(",")]
        except ValueError:
            raise InputError("--at", "", at, "numbers with commas, one a joint") from None
        arm = driver.arms[cell.task.arm]
        try:
            q = joint_positions(cell, "--at", given, arm)
        except InputError as error:
            raise InputError("--at", "", error.given, error.allowed) from None
        return driver.frame_at(name, cell.task.arm, q)
    started = StartedDriver(driver, (name,))
    if started.missing:
        raise InputError("--driver", "", f"no image of {name} came", "a camera that runs")
    return started.frames[name]


def _in_degrees(q: "FloatArray", sliding: "BoolArray") -> "FloatArray":
    result: FloatArray = np.where(sliding, q, np.rad2deg(q))
    return result
