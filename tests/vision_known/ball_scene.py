"""Images of a ball at a known place, its outline drawn exactly, over coloured clutter."""

import cv2
import numpy as np
from known_scene import CAMERA

from vergence.arrays import FloatArray, ImageArray

RADIUS = 0.05
FINE = 4  # samples a pixel along each axis
COLOR = (40, 60, 200)


def ball_place(k: int) -> FloatArray:
    """Where the ball is in image k, m."""
    return np.array((0.02 * np.sin(0.2 * k), 0.01 * np.cos(0.15 * k), 0.4 + 0.01 * np.sin(0.3 * k)))


def outline_of_ball(place: FloatArray, count: int = 400) -> FloatArray:
    """Return the points of a ball (count, 3) at which lines of sight touch it."""
    squared = float(place @ place)
    ahead = 1.0 - RADIUS**2 / squared
    right = np.cross(place, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    down = np.cross(place, right) / np.sqrt(squared)
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)[:, None]
    around = np.cos(angle) * right + np.sin(angle) * down
    return np.asarray(ahead * place + RADIUS * np.sqrt(ahead) * around)


def colored_clutter(rng: np.random.Generator) -> ImageArray:
    """A background of rectangles of all colours."""
    image = np.full((CAMERA.height, CAMERA.width, 3), 120, np.uint8)
    for _ in range(40):
        u, v = rng.integers(0, CAMERA.width), rng.integers(0, CAMERA.height)
        color = rng.integers(20, 230, 3)
        image[v : v + rng.integers(5, 70), u : u + rng.integers(5, 70)] = color
    return image


def drawn_ball(
    place: FloatArray,
    rng: np.random.Generator,
    ground: ImageArray,
    post_px: tuple[int, int] | None = None,
) -> ImageArray:
    """An image (height, width, 3); a post between two columns may stand before the ball."""
    fine = cv2.resize(ground, None, fx=FINE, fy=FINE, interpolation=cv2.INTER_NEAREST)
    pixels = (CAMERA.project(outline_of_ball(place)) + 0.5) * FINE - 0.5
    cv2.fillPoly(fine, [np.round(pixels * 16).astype(np.int32)], COLOR, cv2.LINE_8, 4)
    image = cv2.resize(fine, (CAMERA.width, CAMERA.height), interpolation=cv2.INTER_AREA)
    if post_px is not None:
        image[:, post_px[0] : post_px[1]] = (30, 160, 90)
    noisy = image + rng.normal(0.0, 2.0, image.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
