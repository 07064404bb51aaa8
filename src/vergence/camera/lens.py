"""A camera's lens and image size as one array, for kernels."""

from numba import njit

from vergence.arrays import FloatArray, frozen
from vergence.camera.distortion import distort, distortion_slope, undistort
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
def normalized_of(lens: FloatArray, u: float, v: float) -> tuple[float, float]:
    """Return the normalized coordinates of a pixel: the inverse of `pixel_of`."""
    x, y = (u - lens[CX]) / lens[FX], (v - lens[CY]) / lens[FY]
    return undistort(x, y, lens[K1], lens[K2], lens[P1], lens[P2], lens[K3])


@njit(cache=True, error_model="numpy")
def normalized_covariance(
    lens: FloatArray, x: float, y: float, covariance_px: FloatArray, covariance: FloatArray
) -> None:
    """Fill in the covariance (2, 2) of normalized (x, y), given that of its pixel, (2, 2) px²."""
    fx, fy = lens[FX], lens[FY]
    uu, vv = covariance_px[0, 0] / (fx * fx), covariance_px[1, 1] / (fy * fy)
    uv = covariance_px[1, 0] / (fx * fy)
    xx, xy, yy = distortion_slope(x, y, lens[K1], lens[K2], lens[P1], lens[P2], lens[K3])
    determinant = xx * yy - xy * xy
    a, b, c = yy / determinant, -xy / determinant, xx / determinant  # of the inverse slope
    covariance[0, 0] = a * a * uu + 2.0 * a * b * uv + b * b * vv
    covariance[1, 1] = b * b * uu + 2.0 * b * c * uv + c * c * vv
    covariance[0, 1] = covariance[1, 0] = a * b * uu + (a * c + b * b) * uv + b * c * vv


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
