"""What a calibration leaves behind: a camera file, and tables for a cell."""

from pathlib import Path

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera, write_camera
from vergence.camera.calibration import MountingFit
from vergence.geometry import matrix_to_rpy

CAMERA, TABLE = "camera.yaml", "camera.toml"


def write_results(
    folder: Path, camera: Camera, mounting: MountingFit | None, T_world_base: FloatArray, name: str
) -> None:
    """Write the camera as camera_info, and as a table of a cell file.

    Args:
        folder: where to.
        camera: the lens.
        mounting: how it is mounted, if that was asked.
        T_world_base: pose of the arm's base, (4, 4); a fixed camera's pose is told from it.
        name: of the camera.
    """
    write_camera(camera, folder / CAMERA, name)
    (folder / TABLE).write_text(cell_table(camera, mounting, T_world_base, name))


def cell_table(
    camera: Camera, mounting: MountingFit | None, T_world_base: FloatArray, name: str
) -> str:
    """Return the camera as a table of a cell file."""
    lines = [f"[cameras.{name}]"]
    if mounting is not None and mounting.fixed:
        lines += _placement(T_world_base @ mounting.T_mount_camera, "in the world")
    elif mounting is not None:
        lines.append('arm = "NAME"  # the arm that carries it, as the cell calls it')
        lines += _placement(mounting.T_mount_camera, "in the body whose poses were recorded")
    c = camera
    lines += [
        f"resolution = [{c.width}, {c.height}]",
        f"focal_px = [{c.fx:.6f}, {c.fy:.6f}]",
        f"principal_px = [{c.cx:.6f}, {c.cy:.6f}]",
        f"distortion = {_row(c.distortion, 9)}  # k1, k2, p1, p2, k3",
    ]
    return "\n".join(lines) + "\n"


def _placement(T: FloatArray, where: str) -> list[str]:
    yaw, pitch, roll = np.rad2deg(matrix_to_rpy(np.ascontiguousarray(T[:3, :3])))
    return [
        f"position_m = {_row(T[:3, 3], 7)}  # {where}",
        f"rotation_rpy_deg = {_row(np.array([roll, pitch, yaw]), 6)}",
    ]


def _row(values: FloatArray, digits: int) -> str:
    return "[" + ", ".join(f"{value:.{digits}f}" for value in values) + "]"
