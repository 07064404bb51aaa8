"""The law on the target's pose."""

from vergence.assembly.laws.law_context import Site
from vergence.cell.schema import ConstrainedTable, PoseTrajectoryTable, PositionBasedTable
from vergence.control import PositionBasedLaw, TargetKeeper


def pose_law(
    site: Site, table: PositionBasedTable | ConstrainedTable, keeper: TargetKeeper | None = None
) -> PositionBasedLaw:
    """Make the law of the second paper; with a keeper, constrained."""
    world = site.driver.world
    return PositionBasedLaw(
        world.arm_to_target() if site.is_fixed else site.arm,
        1.0 / site.driver.inner_rate_hz,
        T_world_camera=site.believed_pose if site.is_fixed else None,
        **table.model_dump(include={*PoseTrajectoryTable.model_fields, "singular_below"}),
        keeper=keeper,
    )
