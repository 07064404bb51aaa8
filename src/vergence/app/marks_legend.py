"""What the marks in a camera's images mean, as a line of a page."""

import numpy as np

from vergence.app import markup
from vergence.app.overlay import DESIRED, FOUND, LOST, TRUE, UNASKED, WINDOW, web_color
from vergence.runtime.results import CameraTrace, Run

_INK = {
    "tracked": (
        f'<circle cx="8" cy="8" r="5" fill="none" stroke="{web_color(FOUND)}" stroke-width="2"/>'
    ),
    "not found": f'<path d="M4 4l8 8M12 4l-8 8" stroke="{web_color(LOST)}" stroke-width="2"/>',
    "not looked for": (
        f'<path d="M6 6l4 4M10 6l-4 4" stroke="{web_color(UNASKED)}" stroke-width="2"/>'
    ),
    "window around the predicted place": (
        f'<path d="M2.5 2.5h11v11h-11z" fill="none" stroke="{web_color(WINDOW)}" stroke-width="1"/>'
    ),
    "desired": f'<path d="M8 2v12M2 8h12" stroke="{web_color(DESIRED)}" stroke-width="2"/>',
    "true": (
        f'<circle cx="8" cy="8" r="2.5" fill="none" stroke="{web_color(TRUE)}" stroke-width="2"/>'
    ),
}


def marks_legend(run: Run, camera: str) -> str:
    """Return the marks that occur in a camera's images, of whichever target, with their meaning."""
    found = {name for trace in run.seen_by(camera) for name in _occurring(trace)}
    return markup.marks({name: ink for name, ink in _INK.items() if name in found})


def _occurring(trace: CameraTrace) -> list[str]:
    """Return the names of the marks of one target."""
    known = np.isfinite(trace.points_px[..., 0])
    occurs = {
        "tracked": trace.found,
        "not found": known & trace.asked & ~trace.found,
        "not looked for": known & ~trace.asked,
        "window around the predicted place": np.isfinite(trace.window_half_px),
        "desired": np.isfinite(trace.desired_px),
        "true": np.isfinite(trace.true_px),
    }
    return [name for name, where in occurs.items() if where.any()]
