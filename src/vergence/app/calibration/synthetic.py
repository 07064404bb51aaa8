"""Calibration data made from a cell, where the truth is known."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vergence.app.calibration.board_views import board_view, is_shown
from vergence.app.calibration.dataset import Dataset
from vergence.app.progress import bar
from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.camera.calibration import Sighting
from vergence.camera.calibration.arm_poses import write_poses
from vergence.cell import Cell, load_cell
from vergence.errors import InputError, nearest
from vergence.geometry import se3, se3_inverse, transform_points
from vergence.vision.board import Board
from vergence.vision.board_file import BOARD, write_board

_COLUMNS, _ROWS = 9, 6  # inner corners of the board that is made
_MARKER, _DICTIONARY = 0.7, "aruco_4x4_50"  # its markers: their side in squares, and their kind
_SHARE = 0.6  # of the image's width that the board takes up
_FINER = 3  # times as many pixels are rendered, then averaged, as a sensor does
_TRIES = 60  # for each image
_TEXTURE_PX = 96  # a square
_MODEL = """<mujoco model="board">
  <asset>
    <texture name="squares" type="2d" file="{texture}"/>
    <material name="squares" texture="squares" specular="0" shininess="0"/>
    <mesh name="face" inertia="shell" face="0 2 1  0 3 2" texcoord="0 0  1 0  1 1  0 1"
      vertex="{left} {top} 0  {right} {top} 0  {right} {bottom} 0  {left} {bottom} 0"/>
  </asset>
  <worldbody>
    <body name="board">
      <inertial pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/>
      <geom type="mesh" mesh="face" material="squares" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>
"""


@dataclass(frozen=True, slots=True)
class Truth:
    """What a calibration of the data should find."""

    fixed: bool  # the camera is, and the arm carries the board
    camera: Camera
    T_mount_camera: FloatArray  # (4, 4) in the flange, or in the arm's base where fixed
    T_world_base: FloatArray  # (4, 4) of the arm


class Studio:
    """A cell with a board before one of its cameras, and poses of the arm from which it is seen.

    Args:
        name_or_path: the cell.
        camera: which of its cameras; that of its task by default.
        charuco: whether the board is one; else it is a chessboard.
        folder: where the board's model goes.
        seed: of poses and noise.
    """

    def __init__(
        self, name_or_path: str, camera: str | None, charuco: bool, folder: Path, seed: int
    ) -> None:
        from vergence.simulation.renderer import choose_renderer

        choose_renderer(needed=False)
        from vergence.simulation.sensor import Sensor
        from vergence.simulation.world import World

        cell = load_cell(name_or_path)
        self.name = camera or cell.task.camera
        if self.name not in cell.cameras:
            raise InputError(
                "vergence calibrate", "--watch", self.name, nearest(self.name, cell.cameras)
            )
        self.fixed = cell.cameras[self.name].arm is None
        self._rng, self._noise = (np.random.default_rng([seed, k]) for k in range(2))
        before = World(cell)
        self.arm = cell.cameras[self.name].arm or _nearest_arm(cell, before)
        self.camera = before.cameras[self.name]
        self._depth = _usual_depth(before, self.name)
        self.board = self._board(charuco)
        self._cell = self._with_board(cell, before, folder)
        self.world = World(self._cell)
        self._tip = (
            self.world.arm_to_target() if self.fixed else self.world.arm_to_camera(self.name)
        )
        self._start = self.world.joint_position(self.arm)
        table, size = self._cell.cameras[self.name], (self.camera.height, self.camera.width)
        self._sensor = Sensor(size, table, self._noise) if table.imaging else None

    @property
    def truth(self) -> Truth:
        """What is to be found."""
        from vergence.simulation.motion import placement_pose

        T_world_base = placement_pose(self._cell.arms[self.arm])
        mount = T_world_base if self.fixed else self._flange()
        T = se3_inverse(mount) @ self.world.camera_pose(self.name)
        return Truth(self.fixed, self.camera, T, T_world_base)

    def pose(self) -> FloatArray:
        """Move the arm so that the camera sees the board from elsewhere; return T_base_flange.

        Raises:
            InputError: if it finds no such place.
        """
        from vergence.robot.inverse_kinematics import finite_range, solve_pose
        from vergence.simulation.motion import placement_pose

        low, high = finite_range(self._tip, self._start)
        for _ in range(_TRIES):
            desired = board_view(self.camera, self.board, self._depth, self._rng)
            goal = (
                self.world.camera_pose(self.name) @ desired
                if self.fixed
                else self.world.target_pose() @ se3_inverse(desired)
            )
            q, _ = solve_pose(self._tip.chain, self._start.copy(), goal, low, high, 60)
            self.world.place_arm(self.arm, q)
            if self._sees():
                T_world_base = placement_pose(self._cell.arms[self.arm])
                return se3_inverse(T_world_base) @ self._flange()
        given = f"{self._cell.name}, in which no pose of {self.arm} shows the board"
        raise InputError("vergence calibrate", "--synthetic", given, "another cell or camera")

    def corners(self, name: str, noise_px: float) -> Sighting:
        """Return the board's corners as the camera sees them now, with noise."""
        seen = transform_points(self._T_camera_board(), self.board.points)
        inside = self.camera.in_view(seen)
        pixels = self.camera.project(seen[inside])
        noise = self._noise.normal(0.0, noise_px, pixels.shape)
        return Sighting(name, self.board.points[inside], pixels + noise)

    def film(self, renderer: Any, noise_grey: float) -> ImageArray:
        """Return the image that the camera takes now."""
        import cv2

        size = (self.camera.width, self.camera.height)
        fine = cv2.resize(renderer.draw(self.world.data), size, interpolation=cv2.INTER_AREA)
        if self._sensor is not None:
            return self._sensor.read(np.asarray(fine, dtype=np.uint8))
        noisy = fine + self._noise.normal(0.0, noise_grey, fine.shape)
        return np.asarray(np.clip(np.round(noisy), 0, 255), dtype=np.uint8)

    def renderer(self) -> Any:
        """Return what draws images of the camera, finer than it takes them."""
        from vergence.simulation.renderer import CameraRenderer, choose_renderer
        from vergence.simulation.world import World

        choose_renderer()
        c, s = self.camera, _FINER
        lens = {
            "resolution": (c.width * s, c.height * s),
            "focal_mm": None,
            "pixel_um": None,
            "focal_px": (c.fx * s, c.fy * s),
            "principal_px": ((c.cx + 0.5) * s - 0.5, (c.cy + 0.5) * s - 0.5),
        }
        self.world = World(self._cell.replace(cameras={self.name: lens}))
        fine = self.world.cameras[self.name]
        table = self._cell.cameras[self.name]
        ideal = table.model_copy(update={"noise_grey": 0.0, "imaging": None})
        return CameraRenderer(self.world.model, self.name, fine, ideal, self._noise)

    @property
    def noise_grey(self) -> float:
        """The camera's noise, of 255."""
        return self._cell.cameras[self.name].noise_grey

    def _board(self, charuco: bool) -> Board:
        seen_m = self.camera.width * self._depth / self.camera.fx
        square_m = float(f"{_SHARE * seen_m / (_COLUMNS + 2):.2g}")
        marker_m = _MARKER * square_m if charuco else None
        return Board(_COLUMNS, _ROWS, square_m, marker_m, _DICTIONARY)

    def _with_board(self, cell: Cell, world: Any, folder: Path) -> Cell:
        """Put the board where the camera sees it at the start: on the arm, or in the world."""
        facing = se3(np.eye(3), np.array([0.0, 0.0, self._depth]) - self.board.center)
        T = world.camera_pose(self.name) @ facing
        if self.fixed:
            flange = _body(world, f"{self.arm}/{cell.arms[self.arm].body}")
            T[:3, 3] = _held_at(cell, world, flange) - T[:3, :3] @ self.board.center
            T = se3_inverse(flange) @ T
        target = {
            "model": _write_model(folder, self.board),
            "carried_by": self.arm if self.fixed else None,
            "motion": {"kind": "stationary"},
            "features": None,
            "tag": None,
            **_placement(T),
        }
        task = {"kind": "track", "arm": self.arm, "camera": self.name}
        return cell.replace(target=target, task=task)

    def _sees(self) -> bool:
        """Whether enough of the board's corners are in the image, from its front, unhidden."""
        T = self._T_camera_board()
        if not is_shown(self.camera, self.board, T):
            return False
        in_front = self.board.points - (0.0, 0.0, 1e-4)  # of the face, which has no thickness
        in_world = transform_points(self.world.target_pose(), in_front)
        return bool(self.world.sees(self.name, in_world).all())

    def _T_camera_board(self) -> FloatArray:
        T: FloatArray = se3_inverse(self.world.camera_pose(self.name)) @ self.world.target_pose()
        return T

    def _flange(self) -> FloatArray:
        table = self._cell.cameras[self.name]
        body = (None if self.fixed else table.body) or self._cell.arms[self.arm].body
        return _body(self.world, f"{self.arm}/{body}")


def make_data(
    studio: Studio, images: int, folder: Path | None, noise_px: float
) -> tuple[Dataset, Truth]:
    """Make images, board and poses in a folder, or only project, without one.

    Args:
        studio: the cell with a board.
        images: how many.
        folder: where to write them; None gives projected corners, with noise.
        noise_px: standard deviation of these.

    Returns:
        projected corners, or an empty set where images were written; and the truth.
    """
    import cv2

    poses: dict[str, FloatArray] = {}
    sightings = []
    renderer = None if folder is None else studio.renderer()
    progress = bar("{task.completed} / {task.total}")
    task = progress.add_task("take images", total=images)
    with progress:
        for number in range(images):
            name = f"{number:03d}.png"
            poses[name] = studio.pose()
            if folder is None:
                sightings.append(studio.corners(name, noise_px))
            else:
                cv2.imwrite(str(folder / name), studio.film(renderer, studio.noise_grey))
            progress.update(task, advance=1)
    if folder is not None and renderer is not None:
        renderer.close()
        write_poses(folder / "poses.csv", poses)
        write_board(folder / BOARD, studio.board)
    c, arm = studio.camera, np.array(list(poses.values()))
    return Dataset(studio.board, c.width, c.height, tuple(sightings), (), arm), studio.truth


def _nearest_arm(cell: Cell, world: Any) -> str:
    """Return the arm that holds the target, or whose end effector is nearest to it."""
    target = world.target_pose()[:3, 3]

    def distance(name: str) -> float:
        flange = _body(world, f"{name}/{cell.arms[name].body}")
        return float(np.linalg.norm(flange[:3, 3] - target))

    return cell.target.carried_by or min(cell.arms, key=distance)


def _usual_depth(world: Any, camera: str) -> float:
    """Return how far the target is from a camera at the start, along its axis, m."""
    seen = se3_inverse(world.camera_pose(camera)) @ world.target_pose()
    return float(seen[2, 3]) if seen[2, 3] > 0.15 else 0.6


def _held_at(cell: Cell, world: Any, flange: FloatArray) -> FloatArray:
    """Return where in the world an arm holds the middle of the board, (3,), m."""
    if cell.target.carried_by is not None:
        return np.asarray(world.target_pose()[:3, 3])
    return flange[:3, 3] + 0.1 * flange[:3, 2]


def _body(world: Any, name: str) -> FloatArray:
    body = world.data.body(name)
    T: FloatArray = se3(body.xmat.reshape(3, 3).copy(), body.xpos.copy())
    return T


def _placement(T: FloatArray) -> dict[str, Any]:
    from vergence.geometry import matrix_to_rpy

    yaw, pitch, roll = np.rad2deg(matrix_to_rpy(np.ascontiguousarray(T[:3, :3])))
    return {"position_m": T[:3, 3].tolist(), "rotation_rpy_deg": [roll, pitch, yaw]}


def _write_model(folder: Path, board: Board) -> Path:
    """Write the board as a model that MuJoCo reads; return its file."""
    import cv2

    texture = (folder / "board.png").resolve()
    cv2.imwrite(str(texture), board.image(_TEXTURE_PX))
    (width, height), middle = board.outline_m, board.center
    text = _MODEL.format(
        texture=texture,
        left=middle[0] - width / 2,
        right=middle[0] + width / 2,
        top=middle[1] - height / 2,
        bottom=middle[1] + height / 2,
    )
    path = (folder / "board.xml").resolve()
    path.write_text(text)
    return path
