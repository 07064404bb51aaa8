"""A known object: corners in windows, edges of a whole image, a real sequence from end to end.

The sequence is a cube of 84 mm on a table, of Debian's package visp-images-data.
"""

from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from harness import calls, measured, row
from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.estimation.object_follower import OUTLINE_RULE, ObjectFollower, Sighting
from vergence.geometry import se3, so3_exp
from vergence.studies.region_films import CAMERA as FILM_CAMERA
from vergence.studies.region_films import film
from vergence.studies.region_objects import OBJECTS
from vergence.vision.known_object import (
    CornerExtractor,
    EdgeTracker,
    ObjectModel,
    SilhouetteTracker,
)

IMAGES = Path("/usr/share/visp-images-data/ViSP-images/mbt")
PACKAGE = "visp-images-data"
CAMERA = Camera(640, 480, 547.737, 542.074, 338.704, 234.508)
SIDE = 0.084  # m, of the cube; its frame is in a corner
QUADS = ((0, 4, 5, 1), (1, 5, 6, 2), (6, 7, 3, 2), (3, 7, 4, 0), (0, 1, 2, 3), (7, 6, 5, 4))


def cube() -> ObjectModel:
    base = SIDE * np.array([(0, 0, 0), (-1, 0, 0), (-1, 1, 0), (0, 1, 0)])
    triangles = [tri for a, b, c, d in QUADS for tri in ((a, b, c), (a, c, d))]
    return ObjectModel.from_mesh("cube", np.vstack((base, base + (0, 0, SIDE))), triangles)


def start() -> FloatArray:
    """The pose in the first image, as the package has it."""
    values = np.loadtxt(IMAGES / "cube.0.pos")
    T: FloatArray = se3(so3_exp(values[3:].copy()), values[:3].copy())
    return T


def real_images() -> Iterator[ImageArray]:
    import cv2

    for path in sorted((IMAGES / "cube").glob("image*.pgm")):
        yield np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8)


def speed_rows(image: ImageArray, T: FloatArray) -> list[dict[str, Any]]:
    extractor, tracker = CornerExtractor(cube()), EdgeTracker(cube())
    seven, windows = np.array([0, 1, 2, 4, 5, 6, 7]), np.full((7, 2), 12.0)
    covariance = np.diag(np.repeat([0.002, 0.02], 3) ** 2)
    memory = tracker.blank()
    return [
        row(
            "known object: 7 corners in windows of 24 px",
            calls(lambda: extractor.measure(image, CAMERA, T, seven, windows)),
        ),
        row(
            "known object: all edges, 640 x 480",
            calls(lambda: tracker.measure(image, CAMERA, T, covariance, memory)),
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
    if not (IMAGES / "cube").is_dir():
        none = measured(name, float("nan"), "%")
        return [none | {"peer": f"real images not installed (apt install {PACKAGE})"}]
    images, T = list(real_images()), start()
    follower = ObjectFollower(EdgeTracker(cube()), CAMERA, T, 0.0, 0.04)
    steps = [follower.follow(image, 0.04 * k) for k, image in enumerate(images)]
    share = 100.0 * np.mean([step.sighting is Sighting.SEEN for step in steps])
    return [
        *speed_rows(images[0], T),
        outline_row(),
        measured(name, float(share), "%", at_least=98.0),
    ]


if __name__ == "__main__":
    from run import table

    table(run())
