"""Laws on image points."""

import numpy as np

from vergence.assembly.laws.law_context import Site
from vergence.cell.schema import (
    ConstrainedTable,
    OptimalTrackingTable,
    PathTrackingTable,
    PlainTable,
)
from vergence.control import (
    CameraShare,
    ConstrainedLaw,
    ConstrainedSolver,
    ImageBased,
    Law,
    Objective,
    OptimalTracking,
    OptimalTrackingLaw,
    PathTrackingLaw,
    PlainLaw,
    SeveralCamerasLaw,
)
from vergence.errors import InputError


def optimal_tracking_law(site: Site, table: OptimalTrackingTable) -> Law:
    """Make the law of the first paper."""
    depth = site.depth(site.camera_name, table.depth_m)
    law = OptimalTrackingLaw(
        site.arm,
        site.camera,
        depth,
        axes=table.axes,
        avoidance_axes=table.avoidance_axes,
        Q=table.Q / len(depth),  # shared: the loop gain must not grow with the features
        R=table.R,
        S=table.S,
        period=site.period,
        penalty=table.penalty,
        penalty_k=table.penalty_k,
        avoidance_speed_max=table.avoidance_speed_max_m_s,
        singular_below=table.singular_below,
        flow_smoothing_s=table.flow_smoothing_s,
    )
    return site.to_hand(law)


def path_tracking_law(site: Site, table: PathTrackingTable) -> Law:
    """Make the law of the third paper."""
    return PathTrackingLaw(
        site.arm,
        site.camera,
        table.gain,
        table.interaction,
        flow_smoothing_s=table.flow_smoothing_s,
    )


def plain_law(site: Site, table: PlainTable) -> Law:
    """Make the law of textbooks, for one camera or two."""
    if site.cell.tool is not None:
        return _several_cameras(site, table, site.cell.tool.camera)
    law = PlainLaw(
        site.arm,
        site.camera,
        _objective(site, table, table.objective, site.camera_name),
        site.depth(site.camera_name, table.depth_m),
        flow_smoothing_s=_smoothing(table),
        carries_depth=table.carries_depth,
        singular_below=table.singular_below,
    )
    return site.to_hand(law)


def constrained_image_law(
    site: Site, table: ConstrainedTable, objective: str, solver: ConstrainedSolver
) -> Law:
    """Make the constrained law on image points, for one camera or two."""
    if site.cell.tool is not None:
        return _several_cameras(site, table, site.cell.tool.camera, solver)
    law = ConstrainedLaw(
        solver,
        _objective(site, table, objective, site.camera_name),
        site.depth(site.camera_name, table.depth_m),
        flow_smoothing_s=table.flow_smoothing_s,
        carries_depth=table.carries_depth,
    )
    return site.to_hand(law)


def _several_cameras(
    site: Site,
    table: ConstrainedTable | PlainTable,
    fixed: str,
    solver: ConstrainedSolver | None = None,
) -> Law:
    if table.objective == "optimal_tracking":
        raise InputError("law", "objective", table.objective, "image_based, with two cameras")
    shares = {
        name: CameraShare(
            site.driver.cameras[name],
            _objective(site, table, "image_based", name),
            site.depth(name, table.depth_m),
            site.driver.world.camera_pose(name) if name == fixed else None,
        )
        for name in (site.camera_name, fixed)
    }
    return SeveralCamerasLaw(
        site.arm,
        shares,
        solver=solver,
        flow_smoothing_s=_smoothing(table),
        carries_depth=table.carries_depth,
    )


def _objective(
    site: Site, table: ConstrainedTable | PlainTable, kind: str, camera: str
) -> Objective:
    lens = site.driver.cameras[camera]
    if kind == "image_based":
        return ImageBased(lens, table.gain, table.interaction)
    period = 1.0 / site.cell.cameras[camera].rate_hz
    count = len(site.depth(camera, table.depth_m))
    return OptimalTracking(lens, table.axes, table.Q / count, table.R, period)


def _smoothing(table: ConstrainedTable | PlainTable) -> float:
    """Return over how long the target's motion is smoothed, s; infinite for one that stands."""
    return np.inf if table.flow_smoothing_s is None else table.flow_smoothing_s
