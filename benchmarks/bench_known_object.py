"""A known object: corners in windows, edges of a whole image, a real sequence from end to end.

The sequence is a cube of 84 mm on a table, of Debian's package visp-images-data.
"""

from itertools import count
from typing import Any

import numpy as np

from harness import calls, measured, row
from real_images import CUBE, INSTALL, PERIOD_S
from vergence.arrays import FloatArray, ImageArray
from vergence.estimation.known_object.object_follower import OUTLINE_RULE, ObjectFollower, Sighting
from vergence.studies.region.films import CAMERA as FILM_CAMERA
from vergence.studies.region.films import film
from vergence.studies.region.objects import OBJECTS
from vergence.vision.known_object import (
    CornerExtractor,
    EdgeTracker,
    ObjectModel,
    SilhouetteTracker,
)


def speed_rows(image: ImageArray, T: FloatArray) -> list[dict[str, Any]]:
    extractor, tracker = CornerExtractor(CUBE.model), EdgeTracker(CUBE.model)
    seven, windows = np.array([0, 1, 2, 4, 5, 6, 7]), np.full((7, 2), 12.0)
    covariance = np.diag(np.repeat([0.002, 0.02], 3) ** 2)
    memory = tracker.blank()
    return [
        row(
            "known object: 7 corners in windows of 24 px",
            calls(lambda: extractor.measure(image, CUBE.camera, T, seven, windows)),
        ),
        row(
            "known object: all edges, 640 x 480",
            calls(lambda: tracker.measure(image, CUBE.camera, T, covariance, memory)),
            unit="ms",
            value_aim=20.0,
            round_seconds=0.03,
        ),
    ]


def outline_row() -> dict[str, Any]:
    """A mug of 5184 triangles in a rendered colour image, from image to pose."""
    mesh = OBJECTS["mug"]()
    frame = next(film(mesh, 0, 1, 0.0, 0.0))
    tracker = SilhouetteTracker(ObjectModel.from_mesh("mug", *mesh))
    start = frame.T_camera_target
    follower = ObjectFollower(tracker, FILM_CAMERA, start, 0.0, 0.04, OUTLINE_RULE)
    times = count(0.0, 0.04)
    return row(
        "known object: followed by its outline, 640 x 480",
        calls(lambda: follower.follow(frame.image, next(times))),
        unit="ms",
        value_aim=8.0,
        round_seconds=0.03,
    )


def run() -> list[dict[str, Any]]:
    name = "known object: images of the real cube in which it is seen"
    images = CUBE.images()
    if not images:
        return [measured(name, float("nan"), "%") | {"peer": INSTALL}]
    T = CUBE.first_pose()
    follower = ObjectFollower(EdgeTracker(CUBE.model), CUBE.camera, T, 0.0, PERIOD_S)
    steps = [follower.follow(image, PERIOD_S * k) for k, image in enumerate(images)]
    share = 100.0 * np.mean([step.sighting is Sighting.SEEN for step in steps])
    return [
        *speed_rows(images[0], T),
        outline_row(),
        measured(name, float(share), "%", at_least=98.0),
    ]


if __name__ == "__main__":
    from run import table

    table(run())
