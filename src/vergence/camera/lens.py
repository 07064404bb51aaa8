"""A camera's lens and image size as one array, for kernels."""

from numba import njit

from vergence.arrays import FloatArray, frozen
from vergence.camera.distortion import distort
from vergence.camera.pinhole import Camera

FX, FY, CX, CY, WIDTH, HEIGHT, K1, K2, P1, P2, K3 = range(11)  # places in the array


def pack_lens(camera: Camera) -> FloatArray:
    """Pack a camera for kernels, (11,): fx, fy, cx, cy, width, height, k1, k2, p1, p2, k3."""
    c = camera
    return frozen((c.fx, c.fy, c.cx, c.cy, c.width, c.height, *c.distortion), (11,), "lens")


@njit(cache=True)
def pixel_of(lens: FloatArray, x: float, y: float) -> tuple[float, float]:
    """Return the pixel of normalized (x, y); the model of `Camera`."""
    u, v = distort(x, y, lens[K1], lens[K2], lens[P1], lens[P2], lens[K3])
    return lens[FX] * u + lens[CX], lens[FY] * v + lens[CY]


@njit(cache=True)
def is_one_to_one(lens: FloatArray, x: float, y: float) -> bool:
    """Return whether the distortion is one-to-one at normalized (x, y).

    Beyond the radius where the distorted radius stops growing a point far outside the field of view
    would seem to lie in the image.
    """
    r2 = x * x + y * y
    grows: bool = 1.0 + r2 * (3.0 * lens[K1] + r2 * (5.0 * lens[K2] + r2 * 7.0 * lens[K3])) > 0.0
    return grows


@njit(cache=True)
def in_image(lens: FloatArray, u: float, v: float, margin: float) -> bool:
    """Return whether a pixel lies in the image, at least a margin from its border, px."""
    inside: bool = (
        margin - 0.5 <= u < lens[WIDTH] - 0.5 - margin
        and margin - 0.5 <= v < lens[HEIGHT] - 0.5 - margin
    )
    return inside
