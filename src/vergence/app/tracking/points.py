"""Points followed through footage."""

from collections.abc import Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from vergence.app.tracking.footage import FootageFrame, open_footage
from vergence.arrays import as_floats
from vergence.errors import InputError
from vergence.estimation import TrackedPoints
from vergence.loading import Place, asking, load_part
from vergence.signals import Frame, ImagePoints
from vergence.vision import pick_features

_CAMERA = "footage"


def track_points(
    source: str | Path,
    count: int = 20,
    *,
    points_px: ArrayLike | None = None,
    tracker: str | Mapping[str, Any] = "ssd",
    rate_hz: float | None = None,
    topic: str | None = None,
) -> Iterator[tuple[FootageFrame, ImagePoints]]:
    """Follow points through the images of a folder, of a video, or of a ROS 2 bag.

    Args:
        source: the folder or file.
        count: how many points to pick in the first image, at most.
        points_px: the points in the first image, (M, 2); picked if None.
        tracker: a kind of tracker or its table, as `task.tracker` in a cell file.
        rate_hz: images per second; by default the time stamps of a video or bag, or 25 for a
            folder.
        topic: of the images in a bag, where it has several.

    Yields:
        Each image and the points in it, where they were found, with covariance, and why not.

    Raises:
        InputError: if the images cannot be read, or the first one shows nothing to follow.
    """
    frames = open_footage(source, rate_hz, topic).frames()
    first = next(frames)
    image = Frame(_CAMERA, first.time, first.image, {}).image  # read-only, as in every loop
    assert image is not None
    if points_px is None:
        picked = pick_features(image, count)
        if not picked:
            raise InputError(first.name, "", picked.reason, "an image with texture, or points_px")
        start = picked.points_px
    else:
        start = as_floats(points_px, (None, 2), "points_px")
    part = load_part("tracker", tracker, Place("track_points", "tracker", None), "ssd")
    with asking(part, "track_points", "tracker"):
        tracked = TrackedPoints(_CAMERA, part.start(image, start), len(start))
    for frame in chain((first,), frames):
        observation = tracked.observe((Frame(_CAMERA, frame.time, frame.image, {}),))
        assert observation is not None
        yield frame, observation.views[-1]
