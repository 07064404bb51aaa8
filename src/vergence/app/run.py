"""`vergence run`: run a cell, record it, report it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vergence.app.output import FAILURE, SUCCESS, emit, run_folder, say, warn
from vergence.app.warnings_once import TRACEBACK, tracebacks_in
from vergence.errors import InputError
from vergence.places import RECORDING
from vergence.signals import Outcome, OutcomeKind

if TYPE_CHECKING:
    from vergence.app.options import RunOptions
    from vergence.cell import Cell
    from vergence.runtime import Recorder, Run


def run(options: "RunOptions") -> int:
    """Run a cell in a run folder and print the outcome; return the exit code."""
    cell = _loaded(options)  # report mistakes before loading everything
    folder = run_folder(options.out, options.overwrite, cell.name)
    from vergence.runtime import Recorder

    recorder = Recorder(folder, options.image_every, options.image_quality)
    with tracebacks_in(folder):
        result = _recorded(cell, recorder, options.images, options.driver)
    if not options.as_json:
        _tell_outcome(result)  # at once: what has to be read later is written later
    report = _reported(cell, result, folder)
    if options.as_json:
        emit(_answer(cell.name, result, folder, report))
    else:
        if (traceback := folder / TRACEBACK).exists():
            say(f"  traceback  {traceback}")
        say(f"  report     {report}")
        say(f"  recording  {folder / RECORDING}  (opens in Foxglove and Rerun)")
    return SUCCESS if result.outcome.succeeded else FAILURE


def _loaded(options: "RunOptions") -> "Cell":
    """Return the cell with the settings and the task that the options ask for."""
    from vergence.cell import load_cell

    cell = load_cell(options.cell, overrides(options.settings), options.seed)
    if options.goal is not None and options.points is not None:
        allowed = "only without --goal: one task at a time"
        raise InputError("--points", "", options.points, allowed)
    if options.goal is not None:
        from vergence.assembly import with_goal
        from vergence.camera.image_file import read_image_file

        if not options.goal.is_file():
            raise InputError("--goal", "", options.goal, "an image file that exists")
        read_image_file(options.goal)
        if not options.images:
            allowed = "only with images: the goal is recognised in them"
            raise InputError("--goal", "", f"{options.goal} and --no-images", allowed)
        return with_goal(cell, options.goal)
    if options.points is not None:
        from vergence.assembly import with_points

        return with_points(cell, _pixels(cell, options.points))
    return cell


def _reported(cell: "Cell", result: "Run", folder: Path) -> Path:
    """Write the report of a run that is over; return where it is."""
    from vergence.app.goal_images import keep_goal
    from vergence.app.progress import working
    from vergence.app.report import write_report

    with working("writing the report", cell.name):
        keep_goal(cell, folder, result.info.cameras[cell.task.camera])
        return write_report(folder)


def overrides(settings: Sequence[str] | None) -> dict[str, str]:
    """Split ``key=value`` settings.

    Raises:
        InputError: if one has no key or no value.
    """
    pairs = {}
    for setting in settings or ():
        key, equals, value = (part.strip() for part in setting.partition("="))
        if not (key and equals):
            raise InputError("--set", "", setting, "key=value, such as duration_s=5")
        pairs[key] = value
    return pairs


def _pixels(cell: "Cell", text: str) -> list[tuple[float, float]]:
    """Read points of the task's camera given as ``u,v u,v``."""
    from vergence.simulation.build import intrinsics

    camera = intrinsics(cell.cameras[cell.task.camera])
    try:
        pairs = [tuple(float(number) for number in pair.split(",")) for pair in text.split()]
        points = [(u, v) for u, v in pairs]
    except ValueError:
        points = []
    if not points or not camera.contains(np.array(points)).all():
        allowed = f'pixels as "u,v u,v", inside the image of {camera.width} x {camera.height}'
        raise InputError("--points", "", text, allowed)
    return points


def _recorded(cell: "Cell", recorder: "Recorder", images: bool, driver: str | None = None) -> "Run":
    """Run a cell, in simulation or with a driver; whatever happens, the recording is closed."""
    from vergence.app.progress import RunProgress, working
    from vergence.assembly import (
        check_driver,
        open_driver,
        rehearse,
        run_cell,
        run_driver,
        servo_lag_s,
    )

    if driver is not None:
        check_driver(cell, driver)
        with working("rehearsing in simulation", cell.name):
            rehearse(cell)
    try:
        with RunProgress(cell.name, cell.duration_s) as progress:
            if driver is None:
                return run_cell(cell, (recorder, progress), images)
            opened = open_driver(cell, driver)
            try:
                lag_s, listeners = servo_lag_s(cell, driver), (recorder, progress)
                return run_driver(
                    cell, opened, listeners, images, servo_lag_s=lag_s, self_calibration=True
                )
            finally:
                opened.close()
    except KeyboardInterrupt:  # outside of the loop, which ends a run by itself
        _tell_interrupted(recorder)
        raise SystemExit(FAILURE) from None
    finally:
        reason = "the run ended unexpectedly, without a reason"
        recorder.close(Outcome(OutcomeKind.STOPPED, reason, recorder.now), {})


def _tell_interrupted(recorder: "Recorder") -> None:
    if recorder.running:
        recorder.close(Outcome(OutcomeKind.STOPPED, "stopped by the user", recorder.now), {})
        warn(f"interrupted: what was recorded is kept, see `vergence report {recorder.folder}`")
    else:
        warn("interrupted before the run began: nothing was recorded")


def _answer(name: str, result: "Run", folder: Path, report: Path) -> Mapping[str, object]:
    from vergence.runtime.recording import outcome_json

    return {
        "command": "run",
        "cell": name,
        "outcome": outcome_json(result.outcome),
        "summary": result.summary,
        "run": folder,
        "report": report,
    }


def _tell_outcome(result: "Run") -> None:
    from vergence.runtime.results import ADVICE

    summary = result.summary
    say(str(result.outcome))
    for task in result.outcome.tasks:
        say(f"  {task.begun:6.2f} s  {task.name}: {task.outcome}")
    off_mm = 1e3 * summary.get("final_pose_error_m", 0.0)
    off_deg = summary.get("final_pose_error_deg", 0.0)
    words = [
        (f"{off_mm:.2f} mm, {off_deg:.2f}° from the desired pose", "final_pose_error_m"),
        (f"final error {summary.get('final_error_px', 0.0):.2f} px", "final_error_px"),
        (f"largest {summary.get('max_error_px', 0.0):.2f} px", "max_error_px"),
        (f"drift {summary.get('max_drift_px', 0.0):.2f} px", "max_drift_px"),
        (f"{summary.get('real_time_factor', 0.0):.1f} × real time", "real_time_factor"),
    ]
    if known := [text for text, key in words if key in summary]:
        say("  " + " · ".join(known))
    for event in result.events:
        if event.name in ADVICE:
            say(f"  {event.text}")
