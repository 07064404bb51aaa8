"""`vergence run`: run a cell, record it, report it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from vergence.app.output import FAILURE, SUCCESS, emit, new_folder, say, warn
from vergence.errors import InputError
from vergence.places import RECORDING
from vergence.signals import Outcome, OutcomeKind

if TYPE_CHECKING:
    from vergence.cell import Cell
    from vergence.runtime import Recorder, Run


def run(
    cell: str,
    out: Path | None,
    seed: int | None,
    images: bool,
    image_every: int,
    settings: Sequence[str],
    as_json: bool,
    driver: str | None = None,
    goal: Path | None = None,
    points: str | None = None,
) -> int:
    """Run a cell in a run folder and say how it went; return the exit code."""
    from vergence.cell import load_cell

    loaded = load_cell(cell, overrides(settings), seed)  # a mistake is told before all is loaded
    if goal is not None and points is not None:
        raise InputError("--points", "", points, "nothing with --goal: one task at a time")
    if goal is not None:
        from vergence.assembly import with_goal

        loaded = with_goal(loaded, goal)
    if points is not None:
        from vergence.assembly import with_points

        loaded = with_points(loaded, _pixels(points))
    if out is not None and (out / RECORDING).exists():
        raise InputError("--out", "", f"{out}, which holds a recording", "another folder")
    from vergence.app.goal_images import keep_goal
    from vergence.app.progress import working
    from vergence.app.report import write_report
    from vergence.runtime import Recorder

    recorder = Recorder(out or new_folder(loaded.name), image_every)
    result = _recorded(loaded, recorder, images, driver)
    with working("writing the report"):
        keep_goal(loaded, recorder.folder, result.info.cameras[loaded.task.camera])
        report = write_report(recorder.folder)
    if as_json:
        emit(_answer(loaded.name, result, recorder.folder, report))
    else:
        _tell(result, recorder.folder, report)
    return SUCCESS if result.outcome.succeeded else FAILURE


def overrides(settings: Sequence[str]) -> dict[str, str]:
    """Split ``key=value`` settings.

    Raises:
        InputError: if one has no key or no value.
    """
    pairs = {}
    for setting in settings:
        key, equals, value = (part.strip() for part in setting.partition("="))
        if not (key and equals):
            raise InputError("--set", "", setting, "key=value, such as duration_s=5")
        pairs[key] = value
    return pairs


def _pixels(text: str) -> list[tuple[float, float]]:
    """Read points given as ``u,v u,v``."""
    try:
        pairs = [tuple(float(number) for number in pair.split(",")) for pair in text.split()]
        return [(u, v) for u, v in pairs]
    except ValueError:
        raise InputError("--points", "", text, "pixels as u,v u,v") from None


def _recorded(cell: "Cell", recorder: "Recorder", images: bool, driver: str | None = None) -> "Run":
    """Run a cell, in simulation or with a driver; whatever happens, the recording is closed."""
    from vergence.app.progress import RunProgress, working
    from vergence.assembly import open_driver, rehearse, run_cell, run_driver

    if driver is not None:
        with working("rehearsing in simulation"):
            rehearse(cell)
    try:
        with RunProgress(cell.duration_s) as progress:
            if driver is None:
                return run_cell(cell, (recorder, progress), images)
            opened = open_driver(cell, driver)
            try:
                return run_driver(cell, opened, (recorder, progress), images)
            finally:
                opened.close()
    except KeyboardInterrupt:  # outside of the loop, which ends a run by itself
        _tell_interrupted(recorder)
        raise SystemExit(FAILURE) from None
    finally:
        reason = "the run broke off before it could say why"
        recorder.close(Outcome(OutcomeKind.STOPPED, reason, recorder.now), {})


def _tell_interrupted(recorder: "Recorder") -> None:
    if recorder.running:
        recorder.close(Outcome(OutcomeKind.STOPPED, "stopped by the user", recorder.now), {})
        warn(f"interrupted: what was recorded is kept, see `vergence report {recorder.folder}`")
    else:
        warn("interrupted before the run began: nothing was recorded")


def _answer(name: str, result: "Run", folder: Path, report: Path) -> Mapping[str, object]:
    outcome = result.outcome
    return {
        "command": "run",
        "cell": name,
        "outcome": {
            "kind": outcome.kind.value,
            "reason": outcome.reason,
            "time": outcome.time,
        },
        "summary": result.summary,
        "run": folder,
        "report": report,
    }


def _tell(result: "Run", folder: Path, report: Path) -> None:
    summary = result.summary
    say(str(result.outcome))
    off_mm = 1e3 * summary.get("final_pose_error_m", 0.0)
    off_deg = summary.get("final_pose_error_deg", 0.0)
    words = [
        (f"off the desired pose {off_mm:.2f} mm, {off_deg:.2f}°", "final_pose_error_m"),
        (f"final error {summary.get('final_error_px', 0.0):.2f} px", "final_error_px"),
        (f"largest {summary.get('max_error_px', 0.0):.2f} px", "max_error_px"),
        (f"drift {summary.get('max_drift_px', 0.0):.2f} px", "max_drift_px"),
        (f"{summary.get('real_time_factor', 0.0):.1f} × real time", "real_time_factor"),
    ]
    say("  " + " · ".join(text for text, key in words if key in summary))
    say(f"  report     {report}")
    say(f"  recording  {folder / 'recording.mcap'}  (opens in Foxglove and Rerun)")
