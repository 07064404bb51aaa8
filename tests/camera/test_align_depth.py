"""A depth image moved to where another camera sees it."""

import numpy as np
import pytest

from vergence.camera import Camera
from vergence.camera.align_depth import DepthAlignment
from vergence.geometry import se3, so3_exp

DEPTH, IMAGE = Camera(160, 120, focal_px=110.0), Camera(320, 240, focal_px=300.0)
BESIDE = se3(so3_exp(np.array([0.01, -0.02, 0.015])), np.array([0.05, 0.002, -0.003]))


def plane_depth(camera: Camera, T: np.ndarray, normal: np.ndarray, offset: float) -> np.ndarray:
    """Depth of the plane normal·p = offset, in the depth camera's frame, in a camera at T."""
    v, u = np.mgrid[: camera.height, : camera.width]
    m = camera.normalize(np.column_stack((u.ravel(), v.ravel())).astype(float))
    rays = np.column_stack((m, np.ones(len(m))))
    n, d = T[:3, :3] @ normal, offset + normal @ T[:3, :3].T @ T[:3, 3]
    return (d / (rays @ n)).reshape(camera.height, camera.width).astype(np.float32)


def test_a_slanted_plane_keeps_its_depth() -> None:
    normal = np.array([0.3, -0.2, 1.0])
    measured = plane_depth(DEPTH, np.eye(4), normal, 0.8)
    seen = DepthAlignment(DEPTH, IMAGE, BESIDE).align(measured)
    true = plane_depth(IMAGE, BESIDE, normal, 0.8)
    middle = np.s_[20:-20, 40:-40]
    assert np.isfinite(seen[middle]).all()  # the finer image has no gaps
    assert np.abs(seen[middle] / true[middle] - 1.0).max() < 0.01


def test_the_nearest_surface_counts_and_holes_stay_holes() -> None:
    measured = np.full((120, 160), 2.0, np.float32)
    measured[40:80, 60:100] = 0.5
    measured[:, :20] = 0.0
    measured[:, 140:] = np.nan
    seen = DepthAlignment(DEPTH, DEPTH, se3(np.eye(3), np.array([0.1, 0.0, 0.0]))).align(measured)
    assert seen[60, 60 + 22] == 0.5  # f t / z = 22 px to the right
    assert seen[60, 99 + 22] == 0.5
    assert np.isnan(seen[60, :25]).all()
    assert np.isnan(seen[60, 70])  # behind the near surface's left edge nothing was seen
    assert np.isnan(seen[10, 150:]).all()


def test_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match=r"shape \(2, 3\), the camera has \(120, 160\)"):
        DepthAlignment(DEPTH, IMAGE, BESIDE).align(np.zeros((2, 3), np.float32))
