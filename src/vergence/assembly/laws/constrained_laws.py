"""The constrained servo, for every task."""

from vergence.assembly.laws.image_laws import constrained_image_law
from vergence.assembly.laws.law_context import Site
from vergence.assembly.laws.pose_law import pose_law
from vergence.assembly.pose import target_shape
from vergence.cell.schema import ConstrainedTable, ReachTable
from vergence.control import ConstrainedSolver, HeldTargetKeeper, Law, TargetKeeper
from vergence.errors import InputError
from vergence.robot import manipulability_measure
from vergence.simulation.solids import Solids

_OBJECTIVES = {  # that suit a task, the usual one first
    "track": ("image_based", "optimal_tracking"),
    "follow": ("position_based",),
    "reach": ("image_based",),
}
_VIEW_MARGIN_PX, _JOINT_MARGIN = 10.0, 0.03
_OF_PLAN = 0.5  # share of a plan's margins that is kept: it was made to be followed to within them
_POINT_DEPTHS, _POSE_DEPTHS = (0.5, 2.0), (0.9, 1.1)  # how far off a depth may be


def constrained_law(site: Site, table: ConstrainedTable) -> Law:
    """Make a constrained law with the objective that suits the task."""
    kind = site.cell.task.kind
    suitable = _OBJECTIVES[kind]
    objective = table.objective or suitable[0]
    if objective not in suitable:
        allowed = f"for the task {kind}: {', '.join(suitable)}"
        raise InputError("law", "objective", objective, allowed)
    if objective != "position_based":
        solver = _solver(site, table, site.period, _POINT_DEPTHS)
        return constrained_image_law(site, table, objective, solver)
    solver = _solver(site, table, 1.0 / site.driver.inner_rate_hz, _POSE_DEPTHS)
    keeper_of = HeldTargetKeeper if site.is_fixed else TargetKeeper
    corners = target_shape(site.cell, site.driver.world).corners
    return pose_law(site, table, keeper_of(solver, corners))


def _solver(
    site: Site, table: ConstrainedTable, period: float, depth_range: tuple[float, float]
) -> ConstrainedSolver:
    arm, task = site.arm, site.cell.task
    view_px, joint = _VIEW_MARGIN_PX, _JOINT_MARGIN
    if isinstance(task, ReachTable):  # its joint margin is a share of half a range
        view_px, joint = _OF_PLAN * task.margin_px, _OF_PLAN * task.margin_joint / 2.0
    return ConstrainedSolver(
        arm,
        site.camera,
        period=period,
        order=table.order,
        view_margin_px=view_px if table.view_margin_px is None else table.view_margin_px,
        joint_margin=joint if table.joint_margin is None else table.joint_margin,
        clearance_m=table.clearance_m,
        solids=None if site.is_fixed else Solids(site.driver.world, task.arm),
        manipulability_min=table.manipulability_share
        * manipulability_measure(arm.jacobian(site.start)),
        approach_rate=table.approach_rate_hz,
        depth_range=table.depth_range or depth_range,
        S=table.S,
    )
