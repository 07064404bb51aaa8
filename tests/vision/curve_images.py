"""Images of curves with exact edges, for tests."""

from collections.abc import Callable

import numpy as np

from vergence.geometry import EllipseShape

FINE = 8  # samples a pixel and axis


def drawn(
    inside: Callable[[np.ndarray, np.ndarray], np.ndarray],
    rng: np.random.Generator,
    *,
    size: tuple[int, int] = (240, 320),
    levels: tuple[float, float] = (60.0, 190.0),
    blur_px: float = 0.7,
    noise: float = 2.0,
) -> np.ndarray:
    """The image of a set of places: the share of each pixel inside, blurred, with noise."""
    import cv2

    height, width = size
    x, y = ((np.arange(n * FINE) + 0.5) / FINE - 0.5 for n in (width, height))
    fine = np.asarray(inside(x[None], y[:, None]), dtype=np.float32)
    share = cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA)
    grey = levels[0] + (levels[1] - levels[0]) * cv2.GaussianBlur(share, (0, 0), blur_px)
    return np.clip(np.rint(grey + rng.normal(0.0, noise, size)), 0, 255).astype(np.uint8)


def ellipse_at(centre: object, a: float, b: float, turn: float = 0.0) -> EllipseShape:
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return EllipseShape(np.array(centre, dtype=float), R @ np.diag([a * a, b * b]) @ R.T / 4.0)


def ellipse_image(shape: EllipseShape, rng: np.random.Generator, **options) -> np.ndarray:
    (x, y), M = shape.centre, np.linalg.inv(4.0 * shape.second)

    def inside(u, v):
        du, dv = u - x, v - y
        return M[0, 0] * du * du + 2.0 * M[0, 1] * du * dv + M[1, 1] * dv * dv < 1.0

    return drawn(inside, rng, **options)
