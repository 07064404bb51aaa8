"""A folder of images of a board, with the poses of the arm that took them."""

from pathlib import Path

import cv2
import numpy as np
from calibration_scene import HAND, TABLE

from vergence.camera import Camera
from vergence.camera.calibration.arm_poses import write_poses
from vergence.geometry import rpy_to_matrix, se3, se3_inverse
from vergence.vision import Board

CAMERA = Camera(640, 480, 600.0, 602.0, 325.0, 236.0)
BOARD, SQUARE_PX = Board(9, 6, 0.02), 60


def photograph(T: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The board at T_camera_board through a lens without distortion."""
    to_board = np.diag([BOARD.square_m / SQUARE_PX, BOARD.square_m / SQUARE_PX, 1.0])
    to_board[:2, 2] = -BOARD.square_m * (1.5 - 0.5 / SQUARE_PX)
    fine = np.array([[3.0, 0, 1], [0, 3, 1], [0, 0, 1]])  # pixels a third as large
    H = fine @ CAMERA.matrix @ T[:3, [0, 1, 3]] @ to_board
    large = cv2.warpPerspective(BOARD.image(SQUARE_PX), H, (1920, 1440), borderValue=110)
    small = cv2.resize(large, (640, 480), interpolation=cv2.INTER_AREA)
    return np.clip(0.8 * small + 20 + rng.normal(0, 1.5, small.shape), 0, 255).astype(np.uint8)


def write_board_images(folder: Path) -> None:
    """Write twelve images of the board and the poses of a flange that carries the camera."""
    rng, poses = np.random.default_rng(0), {}
    while len(poses) < 12:
        R = rpy_to_matrix(rng.uniform(-1, 1, 3) * (1.0, 0.55, 0.55))
        x, y = CAMERA.normalize(rng.uniform((250, 190), (390, 290), (1, 2)))[0]
        T = se3(R, np.array([x, y, 1.0]) * rng.uniform(0.33, 0.42) - R @ BOARD.center)
        name = f"img{len(poses) + 1}.png"
        cv2.imwrite(str(folder / name), photograph(T, rng))
        poses[name] = TABLE @ se3_inverse(T) @ se3_inverse(HAND)
    write_poses(folder / "poses.csv", poses)
