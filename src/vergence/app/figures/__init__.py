"""The figures of a report, each made from the arrays of a recording."""

from vergence.app.figures.arm import joints_figure, measures_figure, twist_figure
from vergence.app.figures.constraints import constraints_figure
from vergence.app.figures.image import error_figure, paths_figure
from vergence.app.figures.layout import Panels, mark_events, panels, svg
from vergence.app.figures.motion import (
    camera_figure,
    estimate_figure,
    pose_error_figure,
    target_figure,
)

__all__ = [
    "Panels",
    "camera_figure",
    "constraints_figure",
    "error_figure",
    "estimate_figure",
    "joints_figure",
    "mark_events",
    "measures_figure",
    "panels",
    "paths_figure",
    "pose_error_figure",
    "svg",
    "target_figure",
    "twist_figure",
]
