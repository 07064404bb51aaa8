"""`vergence goal`: take a photograph to go back to."""

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vergence.app.output import FAILURE, SUCCESS, emit, say
from vergence.errors import Absent, InputError
from vergence.parts import kind_of

if TYPE_CHECKING:
    from vergence.app.options import GoalOptions
    from vergence.arrays import BoolArray, FloatArray
    from vergence.cell import Cell
    from vergence.runtime.driver import Driver
    from vergence.signals import Frame


def goal(options: "GoalOptions") -> int:
    """Take the photograph and print where it is; return the exit code."""
    from vergence.app.run import overrides
    from vergence.assembly import open_driver
    from vergence.cell import load_cell
    from vergence.errors import DriverSilent
    from vergence.simulation import SimulatedDriver
    from vergence.vision.matching import image_fault

    if options.out.suffix.lower() not in (".png", ".jpg", ".jpeg"):
        raise InputError("--out", "", options.out, "a file name that ends in .png or .jpg")
    if options.out.exists() and not options.overwrite:
        given = f"{options.out}, which exists"
        raise InputError("--out", "", given, "another file, or --overwrite")
    cell = load_cell(options.cell, overrides(options.settings))
    if options.driver is not None and options.at is not None:
        raise InputError(
            "--at",
            "",
            options.at,
            "only without --driver; with it, move the robot to the goal first",
        )
    driver = open_driver(cell, options.driver) if options.driver else SimulatedDriver(cell)
    try:
        frame = _frame(cell, driver, options.at)
        keep_photograph(options.out, frame, driver, options.distance_m)
    except DriverSilent as silence:
        say(f"no photograph: {silence}")
        return FAILURE
    finally:
        driver.close()
    assert frame.image is not None
    fault = image_fault(frame.image)
    if options.as_json:
        emit({"command": "goal", "cell": cell.name, "goal": options.out, "fault": fault or None})
        return SUCCESS
    say(f"goal  {options.out}, with its camera file and joints beside it")
    if fault:
        say(f"  warning: the image is {fault}; the goal may not be recognised in it")
    say(f"  next: {shlex.join(_next(options, cell))}")
    return SUCCESS


def _next(options: "GoalOptions", cell: "Cell") -> list[str]:
    """Return the command that goes to the photograph, with the target at rest."""
    settings = list(options.settings or ())
    if options.driver is None and kind_of(cell.target.motion) != "stationary":
        settings.append("target.motion=stationary")
    changed = [word for setting in settings for word in ("--set", setting)]
    return ["vergence", "run", str(options.cell), "--goal", str(options.out), *changed]


def keep_photograph(
    path: Path, frame: "Frame", driver: "Driver", distance_m: float | None = None
) -> None:
    """Write an image as a photograph to go back to, with its camera and the joints beside it."""
    from vergence.camera.photograph import write_photograph

    assert frame.image is not None
    camera, arms = driver.cameras[frame.camera], driver.arms
    joints = {name: _in_degrees(q, arms[name].sliding) for name, q in frame.joints.items()}
    write_photograph(path, frame.image, camera, joints, distance_m)


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
            raise InputError("--at", "", at, "numbers separated by commas, one per joint") from None
        arm = driver.arms[cell.task.arm]
        try:
            q = joint_positions(cell, "--at", given, arm)
        except InputError as error:
            raise InputError("--at", "", error.given, error.allowed) from None
        return driver.frame_at(name, cell.task.arm, q)
    started = StartedDriver(driver, (name,))
    if started.missing:
        raise InputError("--driver", "", Absent(f"no image of {name} came"), "a camera that runs")
    return started.frames[name]


def _in_degrees(q: "FloatArray", sliding: "BoolArray") -> "FloatArray":
    result: FloatArray = np.where(sliding, q, np.rad2deg(q))
    return result
