"""The report of a run: one page with numbers, images and figures, made from its recording."""

from html import escape
from importlib.metadata import version
from pathlib import Path

from vergence.app import markup
from vergence.app.figures import (
    Panels,
    camera_figure,
    constraints_figure,
    error_figure,
    estimate_figure,
    joints_figure,
    mark_events,
    measures_figure,
    paths_figure,
    pose_error_figure,
    target_figure,
    twist_figure,
)
from vergence.app.goal_images import goal_section
from vergence.app.marks_legend import marks_legend
from vergence.app.recorded_images import film, key_frames
from vergence.app.table import arm_rows, camera_rows, constraint_rows, run_rows
from vergence.places import RECORDING
from vergence.runtime.recording import Recording
from vergence.runtime.results import CameraTrace, Run

REPORT = "report.html"


def write_report(folder: Path) -> Path:
    """Write the report of a run beside its recording and return where it is.

    Args:
        folder: the run folder, or the recording alone.

    Raises:
        InputError: if the folder holds no recording.
    """
    return report(folder)


def report(run: Run | str | Path, path: str | Path | None = None) -> Path:
    """Write the report of a run, one page that needs nothing but itself; return where it is.

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
    page.write_text(make_report(told), encoding="utf-8")
    return page


def make_report(run: Run) -> str:
    """Return the report as a page that needs nothing but itself."""
    parts = [
        _header(run),
        _summary(run),
        goal_section(run) if isinstance(run, Recording) else "",
        *(_camera(run, name) for name in run.cameras),
        _target(run),
        *(_arm(run, name) for name in run.arms),
        _events(run),
        _cell(run),
        _footer(run),
    ]
    return markup.page(f"{run.info.cell} · vergence", "\n".join(filter(None, parts)))


def _header(run: Run) -> str:
    outcome = run.outcome
    reason = f"after {outcome.time:.2f} s: {outcome.reason}"
    badge = markup.badge(outcome.kind.value, outcome.succeeded)
    return (
        '<header><span class="kicker">vergence run</span>'
        f"<h1>{escape(run.info.cell)}</h1><p>{badge}{escape(reason)}</p></header>"
    )


def _summary(run: Run) -> str:
    tables = [markup.table("Run", run_rows(run))]
    for name, camera in run.cameras.items():
        tables.append(markup.table(f"Camera {name}", camera_rows(camera)))
    for name, arm in run.arms.items():
        tables.append(markup.table(f"Arm {name}", arm_rows(run.info.arms[name], arm)))
        tables.append(markup.table(f"What shaped the motion of {name}", constraint_rows(arm)))
    return markup.section("Summary", markup.cards(tables))


def _camera(run: Run, name: str) -> str:
    trace = run.cameras[name]
    size = run.info.cameras[name]
    return markup.section(
        f"Camera {name}",
        _images(run, name),
        _figure(run, error_figure(trace), "Feature error over time."),
        _figure(
            run,
            pose_error_figure(trace),
            "True distance of the target from its desired pose in this camera.",
        ),
        markup.figure(
            paths_figure(size, trace),
            f"Feature trajectories in the image, {size.width} × {size.height} px.",
        ),
        _figure(run, camera_figure(trace), "How the camera moved since the first image."),
    )


def _images(run: Run, camera: str) -> str:
    frames = key_frames(run, camera) if isinstance(run, Recording) else []
    if not (isinstance(run, Recording) and frames):
        return ""
    stills = "".join(
        markup.image(frame.jpeg, "image/jpeg", f"{frame.time:.2f} s") for frame in frames
    )
    player = markup.film(film(run, camera), poster=frames[0].jpeg)
    return f'{player}{marks_legend(run.cameras[camera])}<div class="frames">{stills}</div>'


def _target(run: Run) -> str:
    """Return what is known of the target, from the camera that the task is about."""
    trace = run.cameras.get(run.info.task_camera)
    if trace is None:
        return ""
    moved = target_figure(trace, run.target)
    return markup.section(
        "Target",
        _figure(run, moved, "How the target moved since the first image."),
        _figure(
            run,
            estimate_figure(trace, run.target),
            "How far the filter's target is from the true one.",
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
        f"Arm {name}",
        _figure(
            run,
            joints_figure(arm, trace),
            "Joints against their limits at −1 and 1; a joint without limits is left out.",
        ),
        _figure(
            run,
            twist_figure(trace),
            f"Twist of {camera} that the law asked for; z is the optical axis.",
        ),
        _figure(
            run,
            constraints_figure(trace),
            "Limits that were active, and those relaxed for others of higher priority.",
        ),
        _figure(
            run,
            measures_figure(trace),
            "How far the arm is from singularities and joint limits, [Nelson1995] eqs. (26), (27).",
        ),
    )


def _figure(run: Run, panels: Panels | None, caption: str) -> str:
    """Return a figure over time, the events marked in it."""
    if panels is None:
        return ""
    panels.axes[0].set_xlim(0.0, max(run.duration, 1e-9))
    mark_events(panels, run.events)
    return markup.figure(panels, caption)


def _events(run: Run) -> str:
    lines = "".join(
        f"<li>{event.time:.2f} s · <b>{escape(event.name)}</b> · {escape(event.text)}</li>"
        for event in run.events
    )
    return markup.section("Events", f"<ol>{lines}</ol>" if lines else "")


def _cell(run: Run) -> str:
    text = escape(run.info.text)
    folded = f"<details><summary>as it was run</summary><pre>{text}</pre></details>"
    return markup.section("Cell file", folded if text else "")


def _footer(run: Run) -> str:
    if not isinstance(run, Recording):
        return f"<footer>Made by vergence {escape(version('vergence'))}.</footer>"
    cut = "" if run.complete else "The recording was cut off; this is what had been written. "
    if run.skipped:
        messages = "message" if run.skipped == 1 else "messages"
        cut += f"{run.skipped} {messages} could not be read. "
    return (
        f"<footer>{cut}Made by vergence {escape(run.version)} from recording.mcap, which "
        "also opens in Foxglove and Rerun.</footer>"
    )
