"""The report of a run: one page with numbers, pictures and figures, made from its recording."""

from html import escape
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
from vergence.app.marks_legend import marks_legend
from vergence.app.pictures import film, key_frames
from vergence.app.table import arm_rows, camera_rows, constraint_rows, run_rows
from vergence.places import RECORDING
from vergence.runtime.recording import CameraTrace, Recording

REPORT = "report.html"


def write_report(run: Path) -> Path:
    """Write the report of a run beside its recording and return where it is.

    Args:
        run: the run folder, or the recording alone.

    Raises:
        InputError: if the folder holds no recording.
    """
    recording = Recording.open(run)
    own = recording.path.name == RECORDING
    path = recording.folder / REPORT if own else recording.path.with_suffix(".html")
    path.write_text(make_report(recording), encoding="utf-8")
    return path


def make_report(recording: Recording) -> str:
    """Return the report as a page that needs nothing but itself."""
    parts = [
        _header(recording),
        _summary(recording),
        *(_camera(recording, name) for name in recording.cameras),
        _target(recording),
        *(_arm(recording, name) for name in recording.arms),
        _events(recording),
        _cell(recording),
        _footer(recording),
    ]
    return markup.page(f"{recording.info.cell} · vergence", "\n".join(filter(None, parts)))


def _header(recording: Recording) -> str:
    outcome = recording.outcome
    kind = outcome.kind.value if outcome else "cut off"
    reason = (
        f"after {outcome.time:.2f} s: {outcome.reason}"
        if outcome
        else f"the recording ends after {recording.duration:.2f} s without an outcome"
    )
    badge = markup.badge(kind, outcome is not None and outcome.succeeded)
    return (
        '<header><span class="kicker">vergence run</span>'
        f"<h1>{escape(recording.info.cell)}</h1><p>{badge}{escape(reason)}</p></header>"
    )


def _summary(recording: Recording) -> str:
    tables = [markup.table("Run", run_rows(recording))]
    for name, camera in recording.cameras.items():
        tables.append(markup.table(f"Camera {name}", camera_rows(camera)))
    for name, arm in recording.arms.items():
        tables.append(markup.table(f"Arm {name}", arm_rows(recording.info.arms[name], arm)))
        tables.append(markup.table(f"What shaped the motion of {name}", constraint_rows(arm)))
    return markup.section("Summary", markup.cards(tables))


def _camera(recording: Recording, name: str) -> str:
    trace = recording.cameras[name]
    size = recording.info.cameras[name]
    return markup.section(
        f"Camera {name}",
        _pictures(recording, name),
        _figure(recording, error_figure(trace), "How far the features are from their places."),
        _figure(
            recording,
            pose_error_figure(trace),
            "How far the target truly is from the pose that is wanted in this camera.",
        ),
        markup.figure(
            paths_figure(size, trace),
            f"The features' ways through the picture, {size.width} × {size.height} px.",
        ),
        _figure(recording, camera_figure(trace), "How the camera moved since the first picture."),
    )


def _pictures(recording: Recording, camera: str) -> str:
    frames = key_frames(recording, camera)
    if not frames:
        return ""
    stills = "".join(
        markup.picture(frame.jpeg, "image/jpeg", f"{frame.time:.2f} s") for frame in frames
    )
    player = markup.film(film(recording, camera), poster=frames[0].jpeg)
    return f'{player}{marks_legend(recording.cameras[camera])}<div class="frames">{stills}</div>'


def _target(recording: Recording) -> str:
    """Return what is known of the target, from the camera that the task is about."""
    trace = recording.cameras.get(recording.info.task_camera)
    if trace is None:
        return ""
    moved = target_figure(trace, recording.target)
    return markup.section(
        "Target",
        _figure(recording, moved, "How the target moved since the first picture."),
        _figure(
            recording,
            estimate_figure(trace, recording.target),
            "How far the filter's target is from the true one.",
        ),
    )


def _stands(trace: CameraTrace | None) -> bool:
    """Whether a camera is known to stand where it was first."""
    return trace is not None and bool((trace.T_world_camera == trace.T_world_camera[:1]).all())


def _arm(recording: Recording, name: str) -> str:
    arm, trace = recording.info.arms[name], recording.arms[name]
    fixed = _stands(recording.cameras.get(recording.info.task_camera))
    camera = "the fixed camera as seen from the hand" if fixed else "the camera in its own frame"
    return markup.section(
        f"Arm {name}",
        _figure(
            recording,
            joints_figure(arm, trace),
            "Joints against their limits at −1 and 1; a joint without limits is left out.",
        ),
        _figure(
            recording,
            twist_figure(trace),
            f"Twist of {camera} that the law asked for; z is the optical axis.",
        ),
        _figure(
            recording,
            constraints_figure(trace),
            "What shaped the commands, and what gave way so that more important things were kept.",
        ),
        _figure(
            recording,
            measures_figure(trace),
            "How far the arm is from singularities and joint limits, [Nelson1995] eqs. (26), (27).",
        ),
    )


def _figure(recording: Recording, panels: Panels | None, caption: str) -> str:
    """Return a figure over time, the events marked in it."""
    if panels is None:
        return ""
    panels.axes[0].set_xlim(0.0, max(recording.duration, 1e-9))
    mark_events(panels, recording.events)
    return markup.figure(panels, caption)


def _events(recording: Recording) -> str:
    lines = "".join(
        f"<li>{event.time:.2f} s · <b>{escape(event.name)}</b> · {escape(event.text)}</li>"
        for event in recording.events
    )
    return markup.section("Events", f"<ol>{lines}</ol>" if lines else "")


def _cell(recording: Recording) -> str:
    text = escape(recording.info.text)
    folded = f"<details><summary>as it was run</summary><pre>{text}</pre></details>"
    return markup.section("Cell file", folded if text else "")


def _footer(recording: Recording) -> str:
    cut = "" if recording.complete else "The recording was cut off; this is what had been written. "
    if recording.skipped:
        messages = "message" if recording.skipped == 1 else "messages"
        cut += f"{recording.skipped} {messages} could not be read. "
    return (
        f"<footer>{cut}Made by vergence {escape(recording.version)} from recording.mcap, which "
        "also opens in Foxglove and Rerun.</footer>"
    )
