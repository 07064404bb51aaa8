"""Grey images of the bytes that robots send."""

import numpy as np

from vergence.arrays import ImageArray

# By ROS's names of encodings; OpenCV's of the conversions.
_CONVERSIONS = {
    "mono8": (1, ""),
    "8UC1": (1, ""),
    "bgr8": (3, "BGR2GRAY"),
    "8UC3": (3, "BGR2GRAY"),
    "rgb8": (3, "RGB2GRAY"),
    "bgra8": (4, "BGRA2GRAY"),
    "rgba8": (4, "RGBA2GRAY"),
    "bayer_rggb8": (1, "BayerRGGB2GRAY"),
    "bayer_bggr8": (1, "BayerBGGR2GRAY"),
    "bayer_gbrg8": (1, "BayerGBRG2GRAY"),
    "bayer_grbg8": (1, "BayerGRBG2GRAY"),
    "yuv422": (2, "YUV2GRAY_UYVY"),
    "uyvy": (2, "YUV2GRAY_UYVY"),
    "yuv422_yuy2": (2, "YUV2GRAY_YUY2"),
    "yuyv": (2, "YUV2GRAY_YUY2"),
}
PIXEL_BYTES = {name: size for name, (size, _) in _CONVERSIONS.items()}  # of each encoding


def grey_image(block: bytes, encoding: str, width: int, height: int) -> ImageArray | None:
    """Return an image (height, width) in grey; None if it has another size or encoding.

    Args:
        block: rows of pixels without padding, or a JPEG or PNG file.
        encoding: one of `PIXEL_BYTES`, or "compressed".
        width: columns that it should have.
        height: rows that it should have.
    """
    import cv2

    flat = np.frombuffer(block, np.uint8)
    if encoding == "compressed":
        image = cv2.imdecode(flat, cv2.IMREAD_GRAYSCALE) if len(flat) else None
        return None if image is None or image.shape != (height, width) else np.asarray(image)
    size, conversion = _CONVERSIONS.get(encoding, (0, ""))
    if len(flat) != size * width * height or not size:
        return None
    if not conversion:
        return flat.reshape(height, width)
    shaped = flat.reshape((height, width) if size == 1 else (height, width, size))
    return np.asarray(cv2.cvtColor(shaped, getattr(cv2, f"COLOR_{conversion}")), dtype=np.uint8)
