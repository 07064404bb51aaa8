"""From a cell's law to the law itself."""

from collections.abc import Sequence

import numpy as np

from vergence.assembly.laws.constrained_laws import constrained_law
from vergence.assembly.laws.image_laws import optimal_tracking_law, path_tracking_law, plain_law
from vergence.assembly.laws.law_context import Site
from vergence.assembly.laws.motion_needed import require_motion
from vergence.assembly.laws.pose_law import pose_law
from vergence.cell import Cell
from vergence.cell.schema import (
    ConstrainedTable,
    OptimalTrackingTable,
    PathTrackingTable,
    PlainTable,
    PositionBasedTable,
)
from vergence.control import AXES, Law, axis_mask
from vergence.errors import InputError
from vergence.features import interaction_matrix_points
from vergence.simulation import SimulatedDriver

_TASK = {  # the only one that a kind of law serves
    "optimal_tracking": "track",
    "plain": "track",
    "position_based": "follow",
    "path_tracking": "reach",
}


def build_law(cell: Cell, driver: SimulatedDriver) -> Law:
    """Make the law that a cell asks for.

    Raises:
        InputError: if the law does not fit the task, or its numbers do not fit the arm.
    """
    kind = cell.law.kind
    if _TASK.get(kind, cell.task.kind) != cell.task.kind:
        serving = sorted(
            {"constrained", *(law for law, task in _TASK.items() if task == cell.task.kind)}
        )
        allowed = f"for the task {cell.task.kind}: {', '.join(serving)}"
        raise InputError(str(cell.path), "law.kind", kind, allowed)
    site = Site(cell, driver)
    try:
        law = _law(site)
    except InputError as error:
        if error.source != "law":
            raise
        # What a law says of its arguments is said of the file's keys.
        key = f"law.{error.key}"
        raise InputError(str(cell.path), key, error.given, error.allowed) from None
    _require_motion(site)
    return law


def _law(site: Site) -> Law:
    match site.cell.law:
        case OptimalTrackingTable() as table:
            return optimal_tracking_law(site, table)
        case ConstrainedTable() as table:
            return constrained_law(site, table)
        case PlainTable() as table:
            return plain_law(site, table)
        case PositionBasedTable() as table:
            return pose_law(site, table)
        case PathTrackingTable() as table:
            return path_tracking_law(site, table)


def _require_motion(site: Site) -> None:
    """Refuse an arm that cannot do with its camera what the law asks of it."""
    cell, name, L = site.cell, site.camera_name, np.eye(6)
    if cell.task.kind != "follow":
        truth = site.truth(name)
        L = interaction_matrix_points(site.camera.normalize(truth.points_px), truth.depth_m)
    named: Sequence[str] = AXES
    if isinstance(cell.law, OptimalTrackingTable) or (
        isinstance(cell.law, PlainTable | ConstrainedTable)
        and cell.law.objective == "optimal_tracking"
    ):
        named = cell.law.axes
    require_motion(str(cell.path), name, site.arm, site.start, L, axis_mask(named, "axes"))
