"""Small images for the study of honesty: a surface seen twice, blurred by pixels, with noise."""

import numpy as np

from vergence.arrays import FloatArray, ImageArray

FINE = 4  # samples a pixel, of the surface
_PIXEL_BLUR = 0.35 * FINE  # standard deviation in samples: a pixel and its lens


def turn(angle: float) -> FloatArray:
    """Return the rotation (2, 2) of the plane by an angle, rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([(c, -s), (s, c)])


def blobs(random: np.random.Generator, side: int) -> FloatArray:
    """Return a surface (side, side) of blobs of several sizes, 0 … 255."""
    import cv2

    surface = np.zeros((side, side))
    for size in (1.0, 2.5, 6.0):  # px
        coarse = int(side / FINE / size) + 4
        noise = cv2.GaussianBlur(random.normal(size=(coarse, coarse)), (0, 0), 1.0)
        noise = cv2.resize(noise, (side, side), interpolation=cv2.INTER_CUBIC)
        surface += noise / noise.std()
    return np.asarray(np.clip(128.0 + 40.0 * surface, 0.0, 255.0))


def lettering(random: np.random.Generator, side: int) -> FloatArray:
    """Return rows of one mark that differ little from one another: look-alikes."""
    surface = np.full((side, side), 190.0)
    pitch, size = int(random.uniform(9, 16)) * FINE, 6 * FINE
    mark = np.kron(random.random((3, 3)) < 0.5, np.ones((2 * FINE, 2 * FINE), bool))
    for top in range(0, side - size, pitch):
        for left in range(0, side - size, pitch):
            if random.random() < 0.95:
                surface[top : top + size, left : left + size][mark] = 60.0
    return surface


def straight_edges(random: np.random.Generator, side: int) -> FloatArray:
    """Return half planes of two grey values: no corner anywhere near the middle."""
    angle, (v, u) = random.uniform(0.0, 2.0 * np.pi), np.indices((side, side)) - side / 2
    across = u * np.cos(angle) + v * np.sin(angle)
    dark, light = random.uniform(30.0, 90.0), random.uniform(130.0, 220.0)
    return np.asarray(dark + (light - dark) * np.clip(across + 0.5, 0.0, 1.0))


def seen(
    random: np.random.Generator, surface: FloatArray, A: FloatArray, side: int, noise_grey: float
) -> ImageArray:
    """Return the image (side, side) of a surface.

    Args:
        random: of the noise.
        surface: (S, S), `FINE` samples a pixel.
        A: affine map (2, 3) from surface to image, both in pixels from their middles.
        side: of the image, px.
        noise_grey: standard deviation, grey levels.
    """
    import cv2

    # Sample s of the surface lies at (s - (S - 1)/2)/FINE px, and a pixel in FINE × FINE samples.
    middle, fine = 0.5 * (len(surface) - 1), side * FINE
    centre = 0.5 * (fine - 1)
    M = np.column_stack((A[:, :2], FINE * A[:, 2] + centre - A[:, :2] @ (middle, middle)))
    warped = cv2.warpAffine(surface, M, (fine, fine), borderMode=cv2.BORDER_REFLECT)
    warped = cv2.GaussianBlur(warped, (0, 0), _PIXEL_BLUR)
    image = warped.reshape(side, FINE, side, FINE).mean(axis=(1, 3))
    noisy = image + noise_grey * random.normal(size=image.shape)
    return np.asarray(np.clip(np.rint(noisy), 0, 255).astype(np.uint8))
