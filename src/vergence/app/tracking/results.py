"""Poses and covariances as files."""

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from vergence.estimation.known_object.object_follower import Step
from vergence.geometry import matrix_to_quaternion

COLUMNS = (
    *("image", "time_s", "sighting"),
    *("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"),
    *("sd_x_m", "sd_y_m", "sd_z_m", "sd_rx_rad", "sd_ry_rad", "sd_rz_rad"),
    *("share", "reason"),
)


class PoseFiles:
    """poses.csv for spreadsheets, poses.jsonl with everything; written as the poses come.

    Poses are those of the object in the camera: z forward, x right, y down. The covariance is that
    of (δp, δθ), t + δp and exp(δθ) R, along the camera's axes, in m and rad.
    Motions that do not show in the image have a large one, and are listed, as are the turned poses
    (4 x 4 matrices) that explain an ambiguous image as well.

    Args:
        folder: where to.
    """

    def __init__(self, folder: Path) -> None:
        self.table = folder / "poses.csv"
        self.lines = folder / "poses.jsonl"

    def __enter__(self) -> Self:
        self._csv = self.table.open("w", newline="")
        self._jsonl = self.lines.open("w")
        self._writer = csv.writer(self._csv)
        self._writer.writerow(COLUMNS)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._csv.close()
        self._jsonl.close()

    def add(self, name: str, step: Step) -> None:
        """Write the pose at one image."""
        pose = pose_record(step)
        deviations = np.sqrt(np.diag(step.covariance)[:6])
        numbers: Sequence[float] = [
            *pose["position_m"],
            *pose["quaternion_wxyz"],
            *deviations.tolist(),
            step.share,
        ]
        words = [f"{number:.9g}" for number in numbers]
        self._writer.writerow([name, f"{step.time:.6f}", step.sighting.value, *words, step.reason])
        self._jsonl.write(json.dumps({"image": name, **pose}) + "\n")


def pose_record(step: Step) -> dict[str, Any]:
    """Return what is known after an image, for JSON."""
    T = np.ascontiguousarray(step.T_camera_target)
    return {
        "time_s": step.time,
        "sighting": step.sighting.value,
        "reason": step.reason,
        "share": step.share,
        "position_m": T[:3, 3].tolist(),
        "quaternion_wxyz": matrix_to_quaternion(np.ascontiguousarray(T[:3, :3])).tolist(),
        "velocity": step.velocity.tolist(),
        "covariance": step.covariance[:6, :6].tolist(),
        "unseen_motions": step.unseen.T.tolist(),
        "alternatives": [pose.tolist() for pose in step.alternatives],
    }
