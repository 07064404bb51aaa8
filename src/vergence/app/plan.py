"""`vergence plan`: plan the path of a cell whose task is to reach, draw it, move nothing."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from vergence.app.output import FAILURE, SUCCESS, emit, page_folder, say
from vergence.errors import InputError, nearest
from vergence.registry import kinds

if TYPE_CHECKING:
    from vergence.app.options import PlanOptions
    from vergence.planning import Path as PlannedPath
    from vergence.planning import Trajectory


def plan(options: "PlanOptions") -> int:
    """Plan, draw and print the result; return the exit code.

    Raises:
        InputError: if the cell cannot be read, or its task is not to reach.
    """
    from vergence.app.run import overrides
    from vergence.cell import load_cell
    from vergence.cell.schema import ReachTable

    changes = overrides(options.settings)
    if options.planner is not None:
        if ":" not in options.planner and options.planner not in kinds("planner"):
            allowed = f"{nearest(options.planner, kinds('planner'))}, or module:Class"
            raise InputError("vergence plan", "--planner", options.planner, allowed)
        several = load_cell(options.cell, changes, options.seed).tasks
        changes["tasks.0.planner" if several else "task.planner"] = options.planner
    cell = load_cell(options.cell, changes, options.seed)
    if not isinstance(cell.task, ReachTable):
        key = "tasks.0.kind" if cell.tasks else "task.kind"
        allowed = "reach; to a photograph, `vergence run CELL --goal PHOTO` plans by itself"
        raise InputError(str(cell.path), key, cell.task.kind, allowed)
    from vergence.app.plan_page import write_plan_page
    from vergence.app.progress import working
    from vergence.assembly import plan as plan_path
    from vergence.assembly.tasks.reach import timed
    from vergence.planning import Path as PlannedPath

    folder = page_folder(options.out, f"{cell.name}-plan")
    with working("planning"):
        found = plan_path(cell, images=options.images)
    answer: dict[str, object] = {"command": "plan", "cell": cell.name, "found": bool(found)}
    if not isinstance(found, PlannedPath):
        reason = str(found)
        emit({**answer, "reason": reason}) if options.as_json else say(f"no path: {reason}")
        return FAILURE
    trajectory = timed(cell, cell.task, found)
    numbers = _numbers(found, trajectory)
    with working("drawing"):
        report = write_plan_page(folder, cell.name, trajectory, numbers)
    if options.as_json:
        emit({**answer, "planner": found.planner, "summary": numbers, "report": report})
    else:
        _tell(found, numbers, report)
    return SUCCESS


def _numbers(path: "PlannedPath", trajectory: "Trajectory") -> Mapping[str, float]:
    return {
        "duration_s": trajectory.duration,
        "camera_length_m": path.camera_length_m,
        "image_margin_px": path.image_margin_px,
        "joint_margin": path.joint_margin,
    }


def _tell(path: "PlannedPath", numbers: Mapping[str, float], report: Path) -> None:
    say(f"path found by the {path.planner} planner")
    say(
        f"  camera  {numbers['camera_length_m']:.2f} m in {numbers['duration_s']:.1f} s"
        f" · at least {numbers['image_margin_px']:.1f} px from the image border"
        f" · at least {100 * numbers['joint_margin']:.1f} % of half a range from joint limits"
    )
    say(f"  report  {report}")
    say(f"  joints  {report.parent / 'joints.csv'}")
