"""Figures of a plan: through the image, through the joints' ranges, in space."""

from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.app.figures.arm import drawn_names, drawn_positions
from vergence.app.figures.layout import panels
from vergence.drawing import legend
from vergence.studies.mezouar2001.path_panels import (
    camera_paths,
    grid,
    image_paths,
    joint_paths,
    space,
)

if TYPE_CHECKING:
    from vergence.planning import Path, Trajectory

_WIDTH = 8.6  # inches


def plan_image_figure(path: "Path") -> Any:
    """Draw the path of each point through the image."""
    drawn, axes = grid(_WIDTH, 5.2, 1, 1)
    image_paths(axes[0, 0], path.problem.camera, path.points_px)
    legend(axes[0, 0])
    return drawn


def plan_joints_figure(trajectory: "Trajectory") -> Any:
    """Draw joint positions and rates over time as shares of their limits."""
    arm = trajectory.path.problem.arm
    time = np.linspace(0.0, trajectory.duration, 400)
    q, rates, _ = (np.array(rows) for rows in zip(*map(trajectory.joints, time), strict=True))
    out = panels(2, height=2.4)
    position, rate = out.axes
    shares, label = drawn_positions(arm, q), "joint position\n(share of its range)"
    joint_paths(position, time, shares, drawn_names(arm), label)
    joint_paths(rate, time, rates / arm.rate_max, arm.names, "joint rate\n(share of its limit)")
    legend(position)
    return out.figure


def plan_space_figure(path: "Path") -> Any:
    """Draw the camera's path past the points, the same scale along all axes."""
    drawn, axes = space(_WIDTH, 5.4)
    camera_paths(axes, [("camera", path.T_world_camera)], path.problem.points_world)
    axes.view_init(elev=22, azim=-60)
    axes.legend(loc="center left", bbox_to_anchor=(1.08, 0.5), frameon=False, fontsize=8.5)
    return drawn
