"""The report of two runs side by side: their numbers in one table, their signals on one axis."""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from vergence.app import markup
from vergence.app.figures.pair import arms_chart, errors_chart
from vergence.app.marks_legend import marks_legend
from vergence.app.recorded_images import camera_images
from vergence.app.report import page_at
from vergence.app.robot_film import robot_film
from vergence.app.signals_csv import write_signals
from vergence.app.table import Row, arm_rows, camera_rows, run_rows
from vergence.errors import listed
from vergence.runtime.recording import Recording

Runs = Mapping[str, Recording]  # by the name that distinguishes them


def write_pair(first: Path, second: Path, out: Path | None = None) -> Path:
    """Write the page of two runs and return where it is; the numbers of each run lie beside it.

    Args:
        first: a run folder, or a recording.
        second: another one.
        out: the page, or the folder to write it to; the first run's folder if None.

    Raises:
        InputError: if a folder holds no recording, or `out` is neither a page nor a folder.
    """
    recordings = [Recording.open(path) for path in (first, second)]
    runs = dict(zip(_names((first, second)), recordings, strict=True))
    name = f"report-against-{_stem(second)}.html"
    page = page_at(out, name) or recordings[0].folder / name
    signals = {name: f"{page.stem}-{number}.csv" for number, name in enumerate(runs, 1)}
    for name, run in runs.items():
        write_signals(run, page.with_name(signals[name]))
    page.write_text(make_pair(runs, signals), encoding="utf-8")
    return page


def make_pair(runs: Runs, signals: Mapping[str, str]) -> str:
    """Return the page of runs beside each other, which needs nothing but itself.

    Args:
        runs: what it is of.
        signals: names of the files beside it that have the numbers of each run.
    """
    cameras = _common([run.cameras for run in runs.values()])
    arms = _common([run.arms for run in runs.values()])
    parts = [
        _header(runs),
        _summary(runs, cameras, arms),
        _robot(runs),
        *(_camera(runs, name) for name in cameras),
        *(_arm(runs, name) for name in arms),
        _footer(signals),
        markup.script("report.js"),
    ]
    title = " and ".join(runs)
    return markup.page(f"{title} · vergence", "\n".join(filter(None, parts)))


def _names(paths: Sequence[Path]) -> list[str]:
    """Return short names of runs, their paths where those are the same."""
    names = [_stem(path) for path in paths]
    return names if len(set(names)) == len(names) else [f"{n}: {p}" for n, p in enumerate(paths, 1)]


def _stem(path: Path) -> str:
    resolved = path.resolve()
    return resolved.name if resolved.is_dir() else resolved.stem


def _common(named: Sequence[Mapping[str, object]]) -> list[str]:
    """Return the names that all have, in the order of the first."""
    return [name for name in named[0] if all(name in other for other in named[1:])]


def _header(runs: Runs) -> str:
    lines = (
        f"{markup.badge(run.outcome.kind.value, run.outcome.succeeded)}"
        f"<b>{escape(name)}</b> ({escape(run.info.cell)}) after {run.outcome.time:.2f} s: "
        f"{escape(run.outcome.reason)}"
        for name, run in runs.items()
    )
    return markup.header("vergence report", " and ".join(runs), *lines)


def _summary(runs: Runs, cameras: Sequence[str], arms: Sequence[str]) -> str:
    tables = [_table("Run", runs, [run_rows(run) for run in runs.values()])]
    if any(tasks := [_task_rows(run) for run in runs.values()]):
        tables.append(_table("Tasks", runs, tasks))
    for name in cameras:
        rows = [camera_rows(run.cameras[name]) for run in runs.values()]
        tables.append(_table(markup.titled("Camera", name), runs, rows))
    for name in arms:
        rows = [arm_rows(run.info.arms[name], run.arms[name]) for run in runs.values()]
        tables.append(_table(markup.titled("Arm", name), runs, rows))
    return markup.section("Summary", *tables, _left_out(runs))


def _left_out(runs: Runs) -> str:
    """Say which cameras and arms only one run has: they are not compared."""
    alone = []
    for label, run in runs.items():
        others = [other for other in runs.values() if other is not run]
        own = [f"camera {name}" for name in run.cameras if _misses(name, others, "cameras")]
        own += [f"arm {name}" for name in run.arms if _misses(name, others, "arms")]
        if own:
            alone.append(f"{listed(own)} of {label}")
    if not alone:
        return ""
    return f"<p>Only in one of the runs, so not compared: {escape('; '.join(alone))}.</p>"


def _misses(name: str, runs: Sequence[Recording], kind: str) -> bool:
    return any(name not in getattr(run, kind) for run in runs)


def _task_rows(run: Recording) -> list[Row]:
    """Return how each of several tasks ended, numbered: two may be of one name."""
    return [
        Row(f"{number}. {task.name}", f"{task.outcome.kind.value}, {task.outcome.time:.2f} s")
        for number, task in enumerate(run.outcome.tasks, 1)
    ]


def _table(title: str, runs: Runs, rows: Sequence[Sequence[Row]]) -> str:
    """Return the rows of all runs as one table, a column a run; what a run lacks is empty."""
    by_name = [{row.name: row for row in own} for own in rows]
    names = dict.fromkeys(name for own in by_name for name in own)
    heading = "".join(f'<th scope="col" class="number">{escape(run)}</th>' for run in runs)
    lines = []
    for name in names:
        cells = [own.get(name, Row(name, "–")) for own in by_name]
        numbers = "".join(f'<td class="number">{escape(cell.value)}</td>' for cell in cells)
        unit = next((cell.unit for cell in cells if cell.unit), "")
        lines.append(
            f'<tr><th scope="row">{escape(name)}</th>{numbers}<td class="unit">{escape(unit)}</td>'
            f"</tr>{_note({run: cell.note for run, cell in zip(runs, cells, strict=True)})}"
        )
    body = "\n".join(lines)
    return (
        f'<h3>{escape(title)}</h3><table class="pair">'
        f"<thead><tr><td></td>{heading}<td></td></tr></thead>"
        f"<tbody>{body}</tbody></table>"
    )


def _note(notes: Mapping[str, str]) -> str:
    """Return a row with what a number is, once if that is the same of all runs."""
    said = {run: note for run, note in notes.items() if note}
    if not said:
        return ""
    own = [f"{escape(run)}: {escape(note)}" for run, note in said.items()]
    same = len(set(said.values())) == 1
    text = escape(next(iter(said.values()))) if same else "<br>".join(own)
    return f'<tr class="remark"><td colspan="{len(notes) + 2}">{text}</td></tr>'


def _robot(runs: Runs) -> str:
    """Return films of the cells from outside; none where one cannot be drawn."""
    films = [
        markup.film(robot_film(run), f"the robot, {label}", escape(label))
        for label, run in runs.items()
    ]
    return markup.section("Robot", markup.beside(*films) if all(films) else "")


def _camera(runs: Runs, name: str) -> str:
    films = [
        markup.film(
            camera_images(run, name).film,
            f"{name}, {label}",
            f"{escape(label)}<br>{marks_legend(run, name)}",
        )
        for label, run in runs.items()
    ]
    traces = {label: run.cameras[name] for label, run in runs.items()}
    chart = markup.chart(errors_chart(traces), "Feature error over time.")
    return markup.section(markup.titled("Camera", name), markup.beside(*films), chart)


def _arm(runs: Runs, name: str) -> str:
    arms = {label: (run.info.arms[name], run.arms[name]) for label, run in runs.items()}
    caption = "Distance of the arm from its limits and from singularities."
    return markup.section(markup.titled("Arm", name), markup.chart(arms_chart(arms), caption))


def _footer(signals: Mapping[str, str]) -> str:
    files = ", ".join(f"{escape(file)} ({escape(name)})" for name, file in signals.items())
    return f"<footer>The numbers of every tick are beside this page: {files}.</footer>"
