"""The charts of a report, each made from the arrays of a recording."""

from vergence.app.figures.arm import clearance_chart, joints_chart, measures_chart, twist_chart
from vergence.app.figures.chart import Chart, Curve, Marks, Panel, Stretches
from vergence.app.figures.chart_svg import chart_svg
from vergence.app.figures.constraints import constraints_chart
from vergence.app.figures.events import event_lines
from vergence.app.figures.features import feature_errors, feature_errors_chart
from vergence.app.figures.image import error_chart, paths_chart
from vergence.app.figures.motion import (
    camera_chart,
    estimate_chart,
    pose_error_chart,
    target_chart,
)

__all__ = [
    "Chart",
    "Curve",
    "Marks",
    "Panel",
    "Stretches",
    "camera_chart",
    "chart_svg",
    "clearance_chart",
    "constraints_chart",
    "error_chart",
    "estimate_chart",
    "event_lines",
    "feature_errors",
    "feature_errors_chart",
    "joints_chart",
    "measures_chart",
    "paths_chart",
    "pose_error_chart",
    "target_chart",
    "twist_chart",
]
