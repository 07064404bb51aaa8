"""What perception asks of others: the poses of its cameras, and points inside windows."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol, TypeAlias

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.estimation.looks import Look
from vergence.estimation.visibility import Visibility
from vergence.signals import Frame, ImagePoints, SearchWindows

Joints: TypeAlias = Mapping[str, FloatArray]  # arm name to joint positions, rad or m
# camera_pose(camera, joints at the exposure) -> T_world_camera (4, 4)
CameraPose: TypeAlias = Callable[[str, Joints], FloatArray]
# find(frame) -> all features of the target wherever they are in the image, or None
Find: TypeAlias = Callable[[Frame], ImagePoints | None]

UNSEEN = (  # a reason for each `ViewStatus`
    "not chosen",
    "behind the camera",
    "outside the image",
    "turned away",
    "hidden by the target itself",
    "something in the way",
)


class Measure(Protocol):
    """Finds features of the target inside windows of one image."""

    def __call__(
        self,
        frame: Frame,
        features: IntArray,
        points_px: FloatArray,
        half_px: FloatArray,
        T_camera_target: FloatArray,
    ) -> ImagePoints:
        """Return the K points asked for, in that order.

        Args:
            frame: the image.
            features: which features of the target, (K,).
            points_px: where they are expected: the windows' centres, (K, 2).
            half_px: half the width and height of the windows, (K, 2).
            T_camera_target: the expected pose, (4, 4): how edges and marks will lie.
        """
        ...


def every_point(
    frames: Sequence[Frame],
    visibility: Visibility,
    looks: Sequence[Look],
    agreeing: Sequence[IntArray],
    widest_px: float,
) -> tuple[ImagePoints, ...]:
    """Return the image points of all M features of each of C images, whether looked for or not.

    A feature that was not found gets its expected place, with a covariance as wide as the
    widest window and the reason. The images share arrays: most of many are not even looked at.

    Args:
        frames: the images, C.
        visibility: what was expected of them.
        looks: what was measured in some of them.
        agreeing: for each look, the numbers of the features that agree with the pose.
        widest_px: half the widest window.
    """
    places = visibility.points_px.copy()
    covariance = np.zeros((*places.shape, 2))
    covariance[..., 0, 0] = covariance[..., 1, 1] = widest_px**2
    found = np.zeros(places.shape[:2], dtype=np.bool_)
    center_px, half_px = np.full((2, *places.shape), np.nan)
    reasons = [[UNSEEN[value] for value in row] for row in visibility.status.tolist()]
    for look, kept in zip(looks, agreeing, strict=True):
        found[look.number, kept] = True
    if looks:
        row = np.repeat([look.number for look in looks], [len(look.features) for look in looks])
        features = np.concatenate([look.features for look in looks])
        center_px[row, features] = places[row, features]
        half_px[row, features] = np.concatenate([look.half_px for look in looks])
        agrees = found[row, features]
        at = row[agrees], features[agrees]
        places[at] = np.concatenate([look.found.points_px for look in looks])[agrees]
        covariance[at] = np.concatenate([look.found.covariance_px for look in looks])[agrees]
        told = [reason for look in looks for reason in look.found.reasons]
        every = zip(row.tolist(), features.tolist(), agrees.tolist(), told, strict=True)
        for n, m, agreed, reason in every:
            reasons[n][m] = reason or ("" if agreed else "disagrees with the pose")
    return tuple(
        ImagePoints(
            frame.camera,
            frame.time,
            places[n],
            covariance[n],
            found[n],
            tuple(reasons[n]),
            SearchWindows(center_px[n], half_px[n]),
        )
        for n, frame in enumerate(frames)
    )


def nothing_found(points: ImagePoints, why: str) -> ImagePoints:
    """Return the same points, none of them found, all for one reason."""
    none = np.zeros(len(points.found), dtype=np.bool_)
    return replace(points, found=none, reasons=(why,) * len(none))
