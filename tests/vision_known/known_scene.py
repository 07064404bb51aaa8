"""Images of a box under a known pose: flat faces, smooth edges, over clutter."""

import cv2
import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.geometry import se3, so3_exp
from vergence.vision.known_object import ObjectModel

CAMERA = Camera(320, 240, 330.0, 325.0, 158.0, 121.0)
HALF = np.array([0.05, 0.04, 0.03])
SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
QUADS = np.array(
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
)
GREYS = (200, 90, 150, 60, 230, 120)
FINE = 8  # samples a pixel along each axis
OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in SIGNS * HALF) + "".join(
    f"f {' '.join(str(k + 1) for k in quad)}\n" for quad in QUADS
)


def box_model() -> ObjectModel:
    triangles = [tri for a, b, c, d in QUADS for tri in ((a, b, c), (a, c, d))]
    return ObjectModel.from_mesh("box", SIGNS * HALF, triangles)


def pose(t: float = 0.0) -> FloatArray:
    """A smooth motion that shows three faces all the time."""
    w = np.array([0.6 + 0.15 * np.sin(1.1 * t), 0.7 + 0.15 * np.sin(0.8 * t), 0.2 * np.sin(t)])
    place = np.array([0.03 * np.sin(1.3 * t), 0.02 * np.sin(1.7 * t), 0.36 + 0.03 * np.sin(t)])
    return se3(so3_exp(w), place)


def off(T: FloatArray, rng: np.random.Generator, metres: float, radians: float) -> FloatArray:
    """A pose that is wrong by about so much."""
    return se3(so3_exp(rng.normal(0, radians, 3)) @ T[:3, :3], T[:3, 3] + rng.normal(0, metres, 3))


def clutter(rng: np.random.Generator) -> ImageArray:
    """A background of faint rectangles in uneven light."""
    image = np.full((CAMERA.height, CAMERA.width), 25.0)
    for _ in range(25):
        u, v = rng.integers(0, CAMERA.width), rng.integers(0, CAMERA.height)
        image[v : v + rng.integers(5, 60), u : u + rng.integers(5, 60)] = rng.uniform(10, 45)
    light = np.linspace(0.7, 1.3, CAMERA.width)
    return np.clip(image * light, 0, 255).astype(np.uint8)


def drawn_image(
    T: FloatArray,
    rng: np.random.Generator,
    background: ImageArray | None = None,
    noise: float = 1.5,
    blur: tuple[int, int] | None = None,
    light: float = 1.0,
) -> ImageArray:
    ground = np.zeros((CAMERA.height, CAMERA.width), np.uint8) if background is None else background
    fine = cv2.resize(ground, None, fx=FINE, fy=FINE, interpolation=cv2.INTER_NEAREST)
    corners = (SIGNS * HALF) @ T[:3, :3].T + T[:3, 3]
    pixels = (CAMERA.project(corners) + 0.5) * FINE - 0.5
    for quad, grey in zip(QUADS, GREYS, strict=True):
        a, b, c = corners[quad[:3]]
        if np.cross(b - a, c - a) @ a < 0.0:
            places = np.round(pixels[quad] * 16).astype(np.int32)
            cv2.fillConvexPoly(fine, places, grey, cv2.LINE_8, 4)
    image = cv2.resize(fine, (CAMERA.width, CAMERA.height), interpolation=cv2.INTER_AREA)
    image = cv2.blur(image, blur) if blur else image
    noisy = image * light + rng.normal(0, noise, image.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def pose_error(T: FloatArray, T_true: FloatArray) -> tuple[float, float]:
    """Distance, m, and angle, rad, between two poses."""
    turn = T[:3, :3] @ T_true[:3, :3].T
    angle = np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))
    return float(np.linalg.norm(T[:3, 3] - T_true[:3, 3])), float(angle)
