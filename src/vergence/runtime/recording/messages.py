"""The same data in Foxglove's message types, which viewers display without configuration."""

from collections.abc import Mapping, Sequence

import numpy as np
from foxglove.messages import (
    CameraCalibration,
    Color,
    CompressedImage,
    FrameTransform,
    FrameTransforms,
    ImageAnnotations,
    JointStates,
    Log,
    LogLevel,
    Point2,
    PointsAnnotation,
    PointsAnnotationType,
    Quaternion,
    Timestamp,
    Vector3,
)
from foxglove.messages import JointState as NamedJoint

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.geometry import matrix_to_quaternion
from vergence.signals import ImagePoints, SearchWindows

NANOSECONDS = 1_000_000_000

# Okabe and Ito's palette, which colour-blind readers can distinguish.
FOUND = Color(r=0.0, g=0.62, b=0.45, a=1.0)
LOST = Color(r=0.84, g=0.37, b=0.0, a=1.0)
DESIRED = Color(r=0.94, g=0.89, b=0.26, a=1.0)
TRUE = Color(r=0.34, g=0.71, b=0.91, a=1.0)
WINDOW = Color(r=0.92, g=0.92, b=0.92, a=0.8)
UNASKED = Color(r=0.67, g=0.67, b=0.67, a=1.0)


_AROUND = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])  # corners of a window


def nanoseconds(time: float) -> int:
    """Return a time of the run in MCAP's unit, ns."""
    return max(round(time * NANOSECONDS), 0)


def stamp(time: float) -> Timestamp:
    """Return a time of the run as a Foxglove time stamp."""
    seconds, rest = divmod(nanoseconds(time), NANOSECONDS)
    return Timestamp(sec=seconds, nsec=rest)


def image(camera: str, time: float, jpeg: bytes) -> CompressedImage:
    """Return an image with its time of exposure."""
    return CompressedImage(timestamp=stamp(time), frame_id=camera, data=jpeg, format="jpeg")


def calibration(name: str, camera: Camera) -> CameraCalibration:
    """Return the intrinsic parameters of a camera."""
    matrix = camera.matrix
    return CameraCalibration(
        frame_id=name,
        width=camera.width,
        height=camera.height,
        distortion_model="plumb_bob",
        D=camera.distortion.tolist(),
        K=matrix.ravel().tolist(),
        R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        P=[value for row in matrix.tolist() for value in (*row, 0.0)],
    )


def annotations(
    time: float,
    points: ImagePoints | None,
    desired_px: FloatArray | None,
    true_px: FloatArray | None,
) -> ImageAnnotations:
    """Return windows and true, desired and tracked points as annotations of the image."""
    layers = []
    if points is not None and points.windows is not None:
        layers.append(_frames(time, points.windows))
    if true_px is not None:
        layers.append(_dots(time, true_px, [TRUE] * len(true_px), 5.0))
    if desired_px is not None:
        layers.append(_dots(time, desired_px, [DESIRED] * len(desired_px), 7.0))
    if points is not None:
        colors = [
            FOUND if found else LOST if asked else UNASKED
            for found, asked in zip(points.found, points.asked, strict=True)
        ]
        layers.append(_dots(time, points.points_px, colors, 3.0))
    return ImageAnnotations(timestamp=stamp(time), points=layers)


def joints(
    time: float, names: Sequence[str], position: FloatArray, velocity: FloatArray
) -> JointStates:
    """Return an arm's joints by name."""
    rows = zip(names, position.tolist(), velocity.tolist(), strict=True)
    named = [NamedJoint(name=name, position=q, velocity=rate) for name, q, rate in rows]
    return JointStates(timestamp=stamp(time), joints=named)


def transforms(time: float, poses: Mapping[str, FloatArray]) -> FrameTransforms:
    """Return poses T_world_x (4, 4) with the names of their frames."""
    return FrameTransforms(
        transforms=[_transform(time, frame, pose) for frame, pose in poses.items()]
    )


def log(time: float, name: str, text: str) -> Log:
    """Return an event as a log entry."""
    return Log(timestamp=stamp(time), level=LogLevel.Info, name=name, message=text)


def _dots(
    time: float, points_px: FloatArray, colors: list[Color], thickness: float
) -> PointsAnnotation:
    # Foxglove has the image's corner at (0, 0), we have the centre of the first pixel there.
    places = [Point2(x=u + 0.5, y=v + 0.5) for u, v in points_px.tolist()]
    return PointsAnnotation(
        timestamp=stamp(time),
        type=PointsAnnotationType.Points,
        points=places,
        outline_colors=colors,
        thickness=thickness,
    )


def _frames(time: float, windows: SearchWindows) -> PointsAnnotation:
    """Return the windows that were opened, each as its four edges."""
    opened = np.isfinite(windows.half_px[:, 0])
    center, half = windows.center_px[opened, None], windows.half_px[opened, None]
    corners = center + half * _AROUND + 0.5
    edges = corners[:, [0, 1, 1, 2, 2, 3, 3, 0]].reshape(-1, 2)
    return PointsAnnotation(
        timestamp=stamp(time),
        type=PointsAnnotationType.LineList,
        points=[Point2(x=u, y=v) for u, v in edges.tolist()],
        outline_color=WINDOW,
        thickness=1.0,
    )


def _transform(time: float, frame: str, pose: FloatArray) -> FrameTransform:
    x, y, z = pose[:3, 3].tolist()
    w, i, j, k = matrix_to_quaternion(pose[:3, :3]).tolist()
    return FrameTransform(
        timestamp=stamp(time),
        parent_frame_id="world",
        child_frame_id=frame,
        translation=Vector3(x=x, y=y, z=z),
        rotation=Quaternion(x=i, y=j, z=k, w=w),
    )
