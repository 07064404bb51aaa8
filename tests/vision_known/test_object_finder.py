"""A lost object with corners is found in a whole image where it is, and not where it is not."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from known_scene import CAMERA, box_model, clutter
from lost_films import moved
from solid_scene import POINTS, drawn_solid, solid

from real_images import IMAGES, PACKAGE
from vergence.arrays import FloatArray, ImageArray
from vergence.assembly.lost_object import ObjectFinder
from vergence.assembly.measure import CornerWindows
from vergence.geometry import se3, so3_exp
from vergence.signals import Frame, ImagePoints
from vergence.vision.known_object import ObjectModel

CAMERAS = {"wrist": CAMERA}
IMAGES_OF_A_ROUND = 25  # at least
NEAR_PX = 2.0


def start(random: np.random.Generator) -> FloatArray:
    R = so3_exp(random.uniform(-0.5, 0.5, 3)) @ so3_exp(np.array((1.0, 0.6, 0.0)))
    return se3(np.ascontiguousarray(R), np.array((0.0, 0.0, random.uniform(0.3, 0.4))))


def found(model: ObjectModel, image: ImageArray, T_last: FloatArray) -> ImagePoints | None:
    finder = ObjectFinder(model, CAMERAS, CornerWindows(model, CAMERAS))
    for k in range(IMAGES_OF_A_ROUND):
        points = finder(Frame("wrist", 0.04 * k, image, {}), T_last)
        if points is not None:
            return points
    return None


def lines(random: np.random.Generator) -> ImageArray:
    image = np.full((CAMERA.height, CAMERA.width), 200, np.uint8)
    for _ in range(150):
        a, b = random.integers((0, 0), (CAMERA.width, CAMERA.height), (2, 2)).tolist()
        cv2.line(image, a, b, int(random.integers(10, 150)), int(random.integers(1, 6)))
    return image


def checks(random: np.random.Generator) -> ImageArray:
    return np.kron(random.integers(20, 230, (12, 16)), np.ones((20, 20))).astype(np.uint8)


def polygons(random: np.random.Generator) -> ImageArray:
    image = np.full((CAMERA.height, CAMERA.width), 60, np.uint8)
    for _ in range(60):
        middle = random.uniform((0, 0), (CAMERA.width, CAMERA.height))
        points = (middle + random.normal(0, 45, (random.integers(3, 6), 2))).astype(np.int32)
        cv2.fillConvexPoly(image, cv2.convexHull(points), int(random.integers(10, 240)))
    return image


@pytest.mark.parametrize("texture", [clutter, lines, checks, polygons])
@pytest.mark.parametrize("name", POINTS)
def test_it_is_not_found_in_textures(
    name: str, texture: Callable[[np.random.Generator], ImageArray]
) -> None:
    random = np.random.default_rng(5)
    assert found(solid(name), texture(random), start(random)) is None


@pytest.mark.parametrize("seed", range(20))
def test_another_solid_is_not_taken_for_it(seed: int) -> None:
    random = np.random.default_rng(seed)
    T = start(random)
    other = solid(["house", "ramp", "prism"][seed % 3])
    sides = random.uniform(0.6, 1.4, 3)
    other = ObjectModel.from_mesh("other", other.vertices * sides, other.triangles)
    there = moved(T, np.zeros(3), random, 0.02, random.uniform(0, 0.6))
    image = drawn_solid(other, there, checks(random), random)
    assert found(solid("tower"), image, T) is None


@pytest.mark.parametrize("name", ["circle", "ellipse", "line", "cube"])
def test_it_is_not_found_in_real_images_of_other_things(name: str) -> None:
    files = sorted(IMAGES.glob(f"{name}/*.p?m")) or sorted(IMAGES.glob(f"mbt/{name}/*.p?m"))
    assert files, f"install {PACKAGE}"
    for seed, file in enumerate(files[:: max(1, len(files) // 4)]):
        image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        small = cv2.resize(image, (CAMERA.width, CAMERA.height), interpolation=cv2.INTER_AREA)
        random = np.random.default_rng(seed)
        assert found(box_model(), np.asarray(small, np.uint8), start(random)) is None, file.name


def test_it_is_found_where_it_is_in_clutter_or_no_pose_is_stated() -> None:
    count = 0
    for seed in range(12):
        random = np.random.default_rng(seed)
        model, T = solid("tower"), start(random)
        there = moved(T, np.zeros(3), random, 0.02, random.uniform(0, 0.5))
        points = found(model, drawn_solid(model, there, clutter(random), random), T)
        if points is None:
            continue
        true_px = CAMERA.project(model.corners @ there[:3, :3].T + there[:3, 3])
        off_px = np.linalg.norm(points.points_px - true_px, axis=1)[points.found]
        assert np.median(off_px) < NEAR_PX
        count += 1
    assert count >= 7  # elsewhere two poses explain the image equally well
