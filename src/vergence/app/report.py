"""The report of a run: one page with numbers, images and figures, made from its recording."""

from collections.abc import Mapping
from html import escape
from importlib.metadata import version
from pathlib import Path

from vergence.app import markup
from vergence.app.figures import (
    Chart,
    camera_chart,
    clearance_chart,
    constraints_chart,
    error_chart,
    estimate_chart,
    event_lines,
    feature_errors_chart,
    joints_chart,
    measures_chart,
    paths_chart,
    pose_error_chart,
    target_chart,
    twist_chart,
)
from vergence.app.goal_images import goal_section
from vergence.app.marks_legend import marks_legend
from vergence.app.recorded_images import camera_images
from vergence.app.signals_csv import SIGNALS, write_signals
from vergence.app.table import arm_rows, camera_rows, constraint_rows, run_rows, task_rows
from vergence.errors import InputError
from vergence.places import RECORDING
from vergence.runtime.recording import Recording
from vergence.runtime.results import CameraTrace, Run, TargetTrace

REPORT = "report.html"


def write_report(folder: Path, page: Path | None = None) -> Path:
    """Write the report of a run and return where it is.

    Args:
        folder: the run folder, or the recording alone.
        page: file to write; beside the recording if None.

    Raises:
        InputError: if the folder holds no recording.
    """
    return report(folder, page)


def page_at(out: Path | None, name: str = REPORT) -> Path | None:
    """Return the page that ``--out`` asks for, its folder made; None if it was not given.

    Args:
        out: a file that ends in ``.html``, or a folder.
        name: of the page in a folder.

    Raises:
        InputError: if it is neither.
    """
    if out is None:
        return None
    page = out if out.suffix.lower() == ".html" else out / name
    if out != page and (out.is_file() or (out.suffix and not out.is_dir())):
        raise InputError("--out", "", out, "a file name that ends in .html, or a folder")
    page.parent.mkdir(parents=True, exist_ok=True)
    return page


def report(run: Run | str | Path, path: str | Path | None = None) -> Path:
    """Write the report of a run, one page that needs nothing but itself; return where it is.

    The run's numbers are written beside it, as ``signals.csv``.

    Args:
        run: a run in memory, whose page is without images, a run folder, or a recording.
        path: of the page; beside the recording if None, or else ``report.html`` in this folder.

    Raises:
        InputError: if the folder holds no recording.
    """
    told = run if isinstance(run, Run) else Recording.open(run)
    page = Path(path) if path is not None else Path(REPORT)
    if path is None and isinstance(told, Recording):
        own = told.path.name == RECORDING
        page = told.folder / REPORT if own else told.path.with_suffix(".html")
    signals = page.with_name(SIGNALS if page.name == REPORT else f"{page.stem}-{SIGNALS}")
    write_signals(told, signals)
    page.write_text(make_report(told, signals.name), encoding="utf-8")
    return page


def make_report(run: Run, signals: str = SIGNALS) -> str:
    """Return the report as a page that needs nothing but itself.

    Args:
        run: what it is of.
        signals: name of the file with the numbers beside it.
    """
    parts = [
        _header(run),
        _summary(run),
        goal_section(run) if isinstance(run, Recording) else "",
        *(_camera(run, name) for name in run.cameras),
        _targets(run),
        *(_arm(run, name) for name in run.arms),
        _events(run),
        _cell(run),
        _footer(run, signals),
        markup.script("report.js"),
    ]
    return markup.page(f"{run.info.cell} · vergence", "\n".join(filter(None, parts)))


def _header(run: Run) -> str:
    return markup.header("vergence run", run.info.cell, markup.ending(run.outcome))


def _summary(run: Run) -> str:
    tables = [markup.table("Run", run_rows(run)), markup.table("Tasks", task_rows(run))]
    for name, camera in run.cameras.items():
        tables.append(markup.table(markup.titled("Camera", name), camera_rows(camera)))
    for name, arm in run.arms.items():
        tables.append(markup.table(markup.titled("Arm", name), arm_rows(run.info.arms[name], arm)))
        tables.append(
            markup.table(f"Limits that shaped the motion of {name}", constraint_rows(arm))
        )
    return markup.section("Summary", markup.cards(tables))


def _camera(run: Run, name: str) -> str:
    trace = run.cameras[name]
    size = run.info.cameras[name]
    film, key_frames = _images(run, name)
    robot = _robot(run) if name == run.info.task_camera else ""
    paths = _chart(
        run,
        paths_chart(size, trace),
        f"Feature trajectories in the image, {size.width} × {size.height} px.",
    )
    return markup.section(
        markup.titled("Camera", name),
        markup.beside(film, robot),
        markup.beside(paths, key_frames),
        _chart(run, error_chart(trace), "Feature error over time."),
        _chart(
            run,
            pose_error_chart(trace),
            "True distance of the target from its desired pose in this camera.",
        ),
        _chart(run, camera_chart(trace), "Motion of the camera since the first image."),
    )


def _images(run: Run, camera: str) -> tuple[str, str]:
    """Return a camera's film and its key frames; both empty where none was recorded."""
    if not isinstance(run, Recording):
        return "", ""
    images = camera_images(run, camera)
    player = markup.film(images.film, f"images of {camera}", marks_legend(run, camera))
    return player, markup.stills(images.key_frames)


def _robot(run: Run) -> str:
    """Return a film of the cell from outside; empty where it cannot be drawn."""
    if not isinstance(run, Recording):
        return ""
    from vergence.app.robot_film import robot_film

    caption = "The cell from outside, drawn from the joints as they were measured."
    return markup.film(robot_film(run), "the robot", caption)


def _targets(run: Run) -> str:
    """Return what is known of each target, from the camera that the task is about."""
    seen = {"Target": (run.cameras, run.target)}
    seen |= {f"Target {name}": (one.cameras, one.target) for name, one in run.others.items()}
    return "\n".join(_target(run, name, *known) for name, known in seen.items())


def _target(
    run: Run, name: str, cameras: Mapping[str, CameraTrace], estimate: TargetTrace | None
) -> str:
    trace = cameras.get(run.info.task_camera)
    if trace is None:
        return ""
    moved = target_chart(trace, estimate)
    return markup.section(
        name,
        _chart(run, moved, "Motion of the target since the first image."),
        _chart(
            run,
            estimate_chart(trace, estimate),
            "Error of the target's pose, as estimated by the filter.",
        ),
    )


def _is_stationary(trace: CameraTrace | None) -> bool:
    """Whether a camera is known to have stayed where it was first."""
    return trace is not None and bool((trace.T_world_camera == trace.T_world_camera[:1]).all())


def _arm(run: Run, name: str) -> str:
    arm, trace = run.info.arms[name], run.arms[name]
    fixed = _is_stationary(run.cameras.get(run.info.task_camera))
    camera = (
        "the fixed camera as seen from the end effector" if fixed else "the camera in its own frame"
    )
    return markup.section(
        markup.titled("Arm", name),
        _chart(run, joints_chart(arm, trace), "Joint positions and rates against their limits."),
        _chart(
            run,
            feature_errors_chart(trace),
            "Errors of the law's features. Lengths are in normalized image coordinates, 1 = the "
            "focal length; angles in rad.",
        ),
        _chart(
            run,
            twist_chart(trace),
            f"Twist of {camera} commanded by the law; z is the optical axis.",
        ),
        _chart(
            run,
            constraints_chart(trace),
            "Limits that were active, and those relaxed for others of higher priority.",
        ),
        _chart(
            run,
            clearance_chart(trace),
            "Smallest distance between the arm and itself or obstacles; gaps: nothing is near.",
        ),
        _chart(
            run,
            measures_chart(trace),
            "Distance from singularities and joint limits, [Nelson1995] eqs. (26), (27).",
        ),
    )


def _chart(run: Run, chart: Chart | None, caption: str) -> str:
    """Return a chart over the whole run, the events marked in it."""
    if chart is not None:
        chart = chart.until(run.duration, event_lines(run.events, run.duration))
    return markup.chart(chart, caption)


def _events(run: Run) -> str:
    events = ((f"{event.time:.2f} s", event.name, event.text) for event in run.events)
    return markup.section("Events", markup.happenings(events))


def _cell(run: Run) -> str:
    text = escape(run.info.text)
    folded = f"<details><summary>as run, with all --set values</summary><pre>{text}</pre></details>"
    return markup.section("Cell file", folded if text else "")


def _footer(run: Run, signals: str) -> str:
    numbers = f"The numbers of every tick are in {escape(signals)} beside this page."
    if not isinstance(run, Recording):
        return f"<footer>{numbers} Made by vergence {escape(version('vergence'))}.</footer>"
    cut = (
        ""
        if run.complete
        else "The recording is incomplete; this page shows what had been written. "
    )
    if run.skipped:
        messages = "message" if run.skipped == 1 else "messages"
        cut += f"{run.skipped} {messages} could not be read. "
    return (
        f"<footer>{cut}{numbers} Made by vergence {escape(run.version)} from "
        f"{escape(run.path.name)}, which also opens in Foxglove and Rerun.</footer>"
    )
