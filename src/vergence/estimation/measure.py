"""What perception asks of others: the poses of its cameras, and points inside windows."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Protocol, TypeAlias

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.estimation.looks import Look
from vergence.estimation.visibility import StatusArray
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


def nothing_measured(
    camera: str, time: float, expected_px: FloatArray, status: StatusArray, widest_px: float
) -> ImagePoints:
    """Return image points of all M features of an image that was not looked at.

    Args:
        camera: whose image.
        time: of its exposure, s.
        expected_px: predicted places, (M, 2).
        status: a `ViewStatus` each, (M,).
        widest_px: half the widest window.
    """
    reasons = tuple([UNSEEN[value] for value in status.tolist()])
    none = np.zeros(len(reasons), dtype=np.bool_)
    covariance = np.zeros((len(reasons), 2, 2))
    covariance[:, 0, 0] = covariance[:, 1, 1] = widest_px**2
    nowhere = np.full_like(expected_px, np.nan)
    windows = SearchWindows(nowhere, nowhere)
    return ImagePoints(camera, time, expected_px, covariance, none, reasons, windows)


def spread_out(
    look: Look,
    kept: IntArray,
    expected_px: FloatArray,
    status: StatusArray,
    widest_px: float,
) -> ImagePoints:
    """Return image points of all M features from those K that were measured.

    A feature that was not found gets its expected place, with a covariance as wide as the
    widest window and the reason.

    Args:
        look: what was measured, K points.
        kept: numbers of the features that agree with the pose.
        expected_px: predicted places, (M, 2).
        status: a `ViewStatus` each, (M,).
        widest_px: half the widest window.
    """
    found, features = look.found, look.features
    places = expected_px.copy()
    covariance = np.zeros((len(places), 2, 2))
    covariance[:, 0, 0] = covariance[:, 1, 1] = widest_px**2
    reasons = [UNSEEN[value] for value in status.tolist()]
    seen = np.zeros(len(places), dtype=np.bool_)
    seen[kept] = True
    agreeing = seen[features]
    for m, agrees, reason in zip(features.tolist(), agreeing.tolist(), found.reasons, strict=True):
        reasons[m] = reason or ("" if agrees else "disagrees with the pose")
    places[features[agreeing]] = found.points_px[agreeing]
    covariance[features[agreeing]] = found.covariance_px[agreeing]
    windows = SearchWindows(np.full_like(places, np.nan), np.full_like(places, np.nan))
    windows.center_px[features] = expected_px[features]
    windows.half_px[features] = look.half_px
    return ImagePoints(found.camera, found.time, places, covariance, seen, tuple(reasons), windows)


def nothing_found(points: ImagePoints, why: str) -> ImagePoints:
    """Return the same points, none of them found, all for one reason."""
    none = np.zeros(len(points.found), dtype=np.bool_)
    return replace(points, found=none, reasons=(why,) * len(none))
