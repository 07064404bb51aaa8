"""What the marks in a camera's images mean, as a line of a page."""

import numpy as np

from vergence.app import markup
from vergence.runtime.results import CameraTrace

_INK = {  # as `overlay` draws them
    "tracked": '<circle cx="8" cy="8" r="5" fill="none" stroke="#14e696" stroke-width="2"/>',
    "not found": '<path d="M4 4l8 8M12 4l-8 8" stroke="#ff6e0a" stroke-width="2"/>',
    "not looked for": '<path d="M6 6l4 4M10 6l-4 4" stroke="#aaaaaa" stroke-width="2"/>',
    "window around the predicted place": (
        '<path d="M2.5 2.5h11v11h-11z" fill="none" stroke="#ebebeb" stroke-width="1"/>'
    ),
    "desired": '<path d="M8 2v12M2 8h12" stroke="#f0e442" stroke-width="2"/>',
    "true": '<circle cx="8" cy="8" r="2.5" fill="none" stroke="#64c8ff" stroke-width="2"/>',
}


def marks_legend(trace: CameraTrace) -> str:
    """Return the marks that occur in a camera's images, with their meaning."""
    known = np.isfinite(trace.points_px[..., 0])
    occurs = {
        "tracked": trace.found,
        "not found": known & trace.asked & ~trace.found,
        "not looked for": known & ~trace.asked,
        "window around the predicted place": np.isfinite(trace.window_half_px),
        "desired": np.isfinite(trace.desired_px),
        "true": np.isfinite(trace.true_px),
    }
    return markup.marks({name: _INK[name] for name, where in occurs.items() if where.any()})
