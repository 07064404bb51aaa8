"""Films of convex solids over clutter, which are lost and reappear with a part hidden."""

from collections.abc import Iterator
from typing import NamedTuple

import cv2
import numpy as np
from known_scene import CAMERA, clutter
from lost_films import moved
from scipy.spatial import ConvexHull

from vergence.arrays import FloatArray, ImageArray
from vergence.geometry import se3, so3_exp
from vergence.vision.known_object import ObjectModel

FINE, NOISE = 4, 1.5
SEEN, SHOWN = 3, 4  # images before it is gone, and after
_ANGLES = 2.0 * np.pi * np.arange(5) / 5
POINTS = {
    "house": [
        (x, y, z) for x in (-1, 1) for y, z in ((-0.6, -0.6), (0.6, -0.6), (0.6, 0.3), (-0.6, 0.3))
    ] + [(-1, 0, 0.8), (1, 0, 0.8)],
    "ramp": [(x, y, z) for y in (-0.7, 0.7) for x, z in ((-1, -0.5), (1, -0.5), (-1, 0.7))],
    "prism": [(np.cos(a), np.sin(a), z) for a in _ANGLES for z in (-0.6, 0.5)],
    "tower": [(s * x, s * y, z) for x in (-1, 1) for y in (-0.8, 0.8)
              for s, z in ((0.9, -0.8), (0.5, 0.9))],
}  # fmt: skip
SIZE_M = 0.05


class Shown(NamedTuple):
    image: ImageArray  # (height, width)
    T_camera_target: FloatArray | None  # (4, 4); None while it is gone
    time: float  # s


def solid(name: str) -> ObjectModel:
    return convex(name, SIZE_M * np.array(POINTS[name], dtype=np.float64))


def convex(name: str, vertices: FloatArray) -> ObjectModel:
    hull = ConvexHull(vertices)
    triangles = []
    for (a, b, c), plane in zip(hull.simplices, hull.equations, strict=True):
        outward = np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a]) @ plane[:3] > 0
        triangles.append((a, b, c) if outward else (a, c, b))
    return ObjectModel.from_mesh(name, vertices, triangles)


def drawn_solid(
    model: ObjectModel, T: FloatArray, ground: ImageArray, random: np.random.Generator
) -> ImageArray:
    """An image of a solid whose faces are lit from one side."""
    fine = cv2.resize(ground, None, fx=FINE, fy=FINE, interpolation=cv2.INTER_NEAREST)
    places = model.vertices @ T[:3, :3].T + T[:3, 3]
    pixels = np.round(((CAMERA.project(places) + 0.5) * FINE - 0.5) * 16).astype(np.int32)
    for triangle, normal in zip(model.triangles, model.normals @ T[:3, :3].T, strict=True):
        if normal @ places[triangle[0]] < 0.0:
            grey = int(130 + 90 * normal @ (0.7, 0.5, -0.5))
            cv2.fillConvexPoly(fine, pixels[list(triangle)], grey, cv2.LINE_8, 4)
    image = cv2.resize(fine, (CAMERA.width, CAMERA.height), interpolation=cv2.INTER_AREA)
    return np.clip(np.rint(image + random.normal(0, NOISE, image.shape)), 0, 255).astype(np.uint8)


def band(
    T: FloatArray, model: ObjectModel, share: float, random: np.random.Generator
) -> ImageArray:
    """A mask of what hides a share of the width of an object, along any direction."""
    outline = CAMERA.project(model.vertices @ T[:3, :3].T + T[:3, 3])
    angle = random.uniform(0.0, 2.0 * np.pi)
    across = np.array((np.cos(angle), np.sin(angle)))
    low, high = (outline @ across).min(), (outline @ across).max()
    first = random.uniform(low - 0.5 * share * (high - low), high - 0.5 * share * (high - low))
    v, u = np.indices((CAMERA.height, CAMERA.width))
    place = u * across[0] + v * across[1]
    return np.asarray((place > first) & (place < first + share * (high - low)))


def half_hidden_film(name: str, seed: int, gone: int) -> Iterator[Shown]:
    """Yield some images of a solid, some without it, and some of it moved and partly hidden."""
    random = np.random.default_rng([seed, list(POINTS).index(name)])
    model, ground = solid(name), clutter(random)
    R = so3_exp(random.uniform(-0.5, 0.5, 3)) @ so3_exp(np.array((1.0, 0.6, 0.0)))
    before = se3(np.ascontiguousarray(R), np.array((0.0, 0.0, random.uniform(0.3, 0.4))))
    after = moved(before, np.zeros(3), random, random.uniform(0.0, 0.01), random.uniform(0, 0.1))
    plain = np.full_like(ground, random.integers(20, 220))
    cover = plain if random.random() < 0.5 else clutter(random)
    hiding = band(after, model, random.uniform(0.25, 0.5), random)
    for k in range(SEEN + gone + SHOWN):
        late = k >= SEEN + gone
        T = before if k < SEEN else after if late else None
        image = ground if T is None else drawn_solid(model, T, ground, random)
        if late:
            image = np.where(hiding, cover, image)
        yield Shown(image, T, 0.04 * k)
