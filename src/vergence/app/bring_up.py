"""`vergence check`: bring up a robot, and leave a page of what was found."""

from collections.abc import Mapping, Sequence
from functools import partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vergence.app import markup, names
from vergence.app.check import table_with_notes
from vergence.app.output import FAILURE, SUCCESS, emit, page_folder, say
from vergence.app.report import REPORT
from vergence.app.run import overrides
from vergence.errors import NOTHING, InputError

if TYPE_CHECKING:
    from vergence.app.options import CheckOptions
    from vergence.cell import Cell
    from vergence.drivers.bring_up import CarriedCamera, Finding

_REMINDERS = (
    "Set payload and centre of gravity of camera and bracket on the robot's own panel.",
    "Set the robot's own speed limits and safety planes; vergence's limits do not replace them.",
)


_FIRST = (
    "Correct what does not hold and check again: joints are moved only once everything at rest "
    "holds."
)


def check(options: "CheckOptions") -> int:
    """Check a robot, print and write what was found; return the exit code."""
    from vergence.assembly import check_driver, open_driver, rehearse
    from vergence.cell import load_cell
    from vergence.drivers.bring_up import bring_up, killed_client_finding

    loaded, driver = load_cell(options.cell, overrides(options.settings)), options.driver
    if driver is None:
        known = f"one of {', '.join(names.drivers())}, or module:Class of your own"
        without = f"without a robot: vergence run {options.cell}"
        raise InputError("vergence check", "--driver", NOTHING, f"{known}; {without}")
    folder = page_folder(options.out, f"check-{loaded.name}")
    check_driver(loaded, driver)
    rehearse(loaded)
    opened = open_driver(loaded, driver)
    findings: list[Finding] = []
    try:
        rates = {name: loaded.cameras[name].rate_hz for name in loaded.watched}
        camera = carried_camera(loaded)
        nudges = np.deg2rad(options.nudge_deg), 1e-3 * options.nudge_mm
        arm = opened.arms[loaded.task.arm]
        for found in bring_up(opened, loaded.task.arm, rates, camera, *nudges):
            findings.append(found)
            if not options.as_json:
                say(_words(found))
    finally:
        opened.close()
    if all(found.holds for found in findings):
        again = partial(open_driver, loaded, driver)
        by = np.where(arm.sliding, nudges[1], nudges[0])
        findings.append(killed_client_finding(again, loaded.task.arm, by))
        if not options.as_json:
            say(_words(findings[-1]))
    page = _write_page(folder, loaded.name, driver, findings)
    holds = all(found.holds for found in findings)
    if options.as_json:
        emit(_answer(loaded.name, driver, findings, page))
    else:
        for reminder in _to_do(holds):
            say(f"  to do  {reminder}")
        say(f"report  {page}")
    return SUCCESS if holds else FAILURE


def _to_do(holds: bool) -> Sequence[str]:
    return _REMINDERS if holds else (_FIRST, *_REMINDERS)


def carried_camera(cell: "Cell") -> "CarriedCamera | None":
    """Return the task's camera, if its arm carries it, with the depth of the target's placement."""
    from vergence.drivers.bring_up import CarriedCamera
    from vergence.simulation.cell_model import CellModel

    name = cell.task.camera
    if cell.cameras[name].arm != cell.task.arm:
        return None
    model = CellModel(cell)
    T_camera_target = np.linalg.inv(model.camera_pose(name)) @ model.target_pose()
    depth_m = max(float(T_camera_target[2, 3]), 0.05)
    return CarriedCamera(name, model.cameras[name], model.arm_to_camera(name), depth_m)


def _words(found: "Finding") -> str:
    sign = "ok   " if found.holds else "WRONG"
    note = f"; {advice}" if (advice := _advice(found)) else ""
    return f"  {sign}  {found.name}: {_number(found)} {found.unit} ({found.allowed}){note}"


def _answer(
    cell: str, driver: str, findings: Sequence["Finding"], page: Path
) -> Mapping[str, object]:
    checks = [
        {
            "name": f.name,
            "measured": float(f.measured),
            "unit": f.unit,
            "allowed": f.allowed,
            "holds": bool(f.holds),
            "note": f.note,
        }
        for f in findings
    ]
    return {"command": "check", "cell": cell, "driver": driver, "checks": checks, "report": page}


def _write_page(folder: Path, cell: str, driver: str, findings: Sequence["Finding"]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    held = sum(found.holds for found in findings)
    badge = markup.badge(f"{held} of {len(findings)} checks hold", held == len(findings))
    todo = _to_do(held == len(findings))
    reminders = "".join(f"<li>{escape(text)}</li>" for text in todo)
    body = [
        markup.header("vergence check", cell, f"{badge}driver {escape(driver)}"),
        markup.section("Checks", _table(findings)),
        markup.section("To do by hand", f"<ul>{reminders}</ul>"),
    ]
    path = folder / REPORT
    path.write_text(markup.page(f"{cell} · vergence check", "\n".join(body)), encoding="utf-8")
    return path


def _table(findings: Sequence["Finding"]) -> str:
    headings = ("check", "measured", "unit", "allowed", "holds")
    rows = [(f.name, _number(f), f.unit, f.allowed, "yes" if f.holds else "NO") for f in findings]
    holds = [bool(found.holds) for found in findings]
    return table_with_notes(headings, rows, holds, [escape(_advice(found)) for found in findings])


def _advice(found: "Finding") -> str:
    """Return what to do about a check that does not hold."""
    return "" if found.holds else found.note


def _number(found: "Finding") -> str:
    return f"{round(float(found.measured), 3) + 0.0:.4g}".replace("-", "−")
