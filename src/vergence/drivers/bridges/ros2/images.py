"""Images as they come."""

from typing import Any, NamedTuple


class Image(NamedTuple):
    """One image, its rows without padding."""

    camera: str
    stamp_ns: int
    encoding: str  # as ROS calls it; "compressed" of a whole JPEG or PNG file
    width: int  # 0 if compressed
    height: int
    block: bytes


def raw_image(camera: str, message: Any, pixel_bytes: dict[str, int]) -> Image:
    """Return an image of `sensor_msgs/Image`.

    Args:
        camera: its name in the cell.
        message: the image.
        pixel_bytes: of the encodings that the driver understands; the bytes of others are left out.
    """
    row = message.width * pixel_bytes.get(message.encoding, 0)
    data = memoryview(message.data).cast("B")
    if message.step == row:
        block = bytes(data[: row * message.height])
    else:
        starts = range(0, message.step * message.height, message.step)
        block = b"".join(data[start : start + row] for start in starts)
    size = message.width, message.height
    return Image(camera, _stamp_ns(message), message.encoding, *size, block)


def compressed_image(camera: str, message: Any) -> Image:
    """Return an image of `sensor_msgs/CompressedImage`."""
    return Image(camera, _stamp_ns(message), "compressed", 0, 0, bytes(message.data))


def intrinsics(message: Any) -> dict[str, Any]:
    """Return what `sensor_msgs/CameraInfo` says of a camera."""
    return {
        "size": [message.width, message.height],
        "matrix": [float(value) for value in message.k],
        "distortion_model": message.distortion_model,
        "distortion": [float(value) for value in message.d],
        "projection": [float(value) for value in message.p],
    }


def _stamp_ns(message: Any) -> int:
    return int(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec)
