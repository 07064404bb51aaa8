"""The page of a plan: its numbers, its figures, and beside it the joints over time as a table."""

import csv
from collections.abc import Mapping
from html import escape
from pathlib import Path

from vergence.app import markup
from vergence.app.figures.plan import plan_image_figure, plan_joints_figure, plan_space_figure
from vergence.app.report import REPORT
from vergence.app.table import Row
from vergence.drawing import save
from vergence.planning import Path as PlannedPath
from vergence.planning import Trajectory

JOINTS = "joints.csv"
_ROWS_PER_S = 50  # of the table of joint positions
_ROOM = "of half the joint's range"


def write_plan_page(
    folder: Path, cell: str, trajectory: Trajectory, numbers: Mapping[str, float]
) -> Path:
    """Write figures, joint positions and a page into a folder; return where the page is."""
    folder.mkdir(parents=True, exist_ok=True)
    path = trajectory.path
    _write_joints(folder / JOINTS, trajectory)
    parts = [
        _header(cell, path),
        markup.section("Summary", markup.cards([markup.table("Path", _rows(numbers))])),
        markup.section("Figures", *_figures(folder, trajectory)),
    ]
    page = folder / REPORT
    page.write_text(markup.page(f"{cell} · vergence plan", "\n".join(parts)), encoding="utf-8")
    return page


def _header(cell: str, path: PlannedPath) -> str:
    words = f"{markup.badge('path found', True)}by the {escape(path.planner)} planner"
    return markup.header("vergence plan", cell, words)


def _rows(numbers: Mapping[str, float]) -> list[Row]:
    return [
        Row("duration", f"{numbers['duration_s']:.2f}", "s"),
        Row("length of the camera's path", f"{numbers['camera_length_m']:.3f}", "m"),
        Row("least distance to the image's border", f"{numbers['image_margin_px']:.1f}", "px"),
        Row("least distance to a joint limit", f"{100 * numbers['joint_margin']:.1f}", "%", _ROOM),
    ]


def _figures(folder: Path, trajectory: Trajectory) -> list[str]:
    """Write the figures into a folder; return them for the page."""
    path = trajectory.path
    width, height = path.problem.camera.width, path.problem.camera.height
    drawn = {
        "image": (
            plan_image_figure(path),
            f"Feature trajectories in the image, {width} × {height} px; ○ start, ■ goal.",
        ),
        "joints": (
            plan_joints_figure(trajectory),
            "Joint positions and rates, as shares of their ranges and limits; limits are at ±1.",
        ),
        "space": (
            plan_space_figure(path),
            "The camera's path; strokes show its viewing direction. The scale comes "
            "from the target's model, task.distance_m or task.length.",
        ),
    }
    figures = []
    for name, (drawing, caption) in drawn.items():
        file = folder / f"{name}.svg"
        save(drawing, file)
        figures.append(markup.image(file.read_bytes(), "image/svg+xml", caption))
    return figures


def _write_joints(file: Path, trajectory: Trajectory) -> None:
    """Write joint positions over time as a table, m and rad."""
    names = trajectory.path.problem.arm.names
    with file.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow(("time_s", *names))
        for k in range(int(trajectory.duration * _ROWS_PER_S) + 2):
            time = min(k / _ROWS_PER_S, trajectory.duration)
            position = trajectory.joints(time)[0]
            table.writerow((f"{time:.3f}", *(f"{value:.6f}" for value in position)))
