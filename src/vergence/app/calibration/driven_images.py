"""Images and arm poses of a robot that is driven from one view of a board to the next."""

from pathlib import Path

import numpy as np

from vergence.app.calibration.driven_arm import DrivenArm
from vergence.app.calibration.from_bag import flange_pose
from vergence.app.calibration.from_robot import Stops, written_poses
from vergence.app.calibration.suggested_poses import board_pose, suggested_poses
from vergence.app.output import warn
from vergence.arrays import FloatArray, ImageArray
from vergence.cell import Cell
from vergence.errors import DriverSilent
from vergence.runtime import Driver
from vergence.signals import Sample
from vergence.vision import Board

_IMAGE_S = 5.0  # for an image at rest


def drive_for_images(
    cell: Cell, driver: Driver, camera: str, board: Board, count: int, folder: Path, seed: int
) -> Path:
    """Drive an arm to poses that show a board, and take an image at each; then brake it.

    Args:
        cell: whose arm and camera these are; its collisions and limits are kept.
        driver: of the robot.
        camera: its name; the arm carries it.
        board: that it sees where the arm is now.
        count: how many images to take.
        folder: to write to.
        seed: of the poses.

    Returns:
        The file of the arm's poses at the images.

    Raises:
        DriverSilent: if the robot does not answer, or does not follow.
        InputError: if the board is not seen, or there are too few poses.
    """
    import cv2

    from vergence.assembly.clearance import cell_clearance
    from vergence.simulation.cell_model import CellModel

    name, model = cell.task.arm, CellModel(cell)
    sample, newest = driver.read(), list[Sample]()
    states = dict(sample.joints)
    model.place({arm: state.position for arm, state in states.items()})
    clearance = cell_clearance(cell, model, lambda: states) if cell.collision.avoid else None
    pose, taken = flange_pose(cell, name, model), dict[str, FloatArray]()

    def hear(sample: Sample) -> None:
        newest[:] = [sample]
        states.update(sample.joints)

    arm = DrivenArm(driver, name, clearance, hear)

    try:
        first, _ = _image_at_rest(driver, arm, name, camera, newest)
        lens, to_camera = model.cameras[camera], model.arm_to_camera(camera)
        T = board_pose(lens, board, first)
        rng = np.random.default_rng(seed)
        for q in suggested_poses(to_camera, lens, board, T, lambda: arm.position, clearance, rng):
            arm.drive(q)
            image, joints = _image_at_rest(driver, arm, name, camera, newest)
            file = f"{len(taken):03d}.png"
            cv2.imwrite(str(folder / file), image)
            taken[file] = pose(joints)
            warn(f"  image {len(taken)} of {count}")
            if len(taken) == count:
                break
    except KeyboardInterrupt:
        warn("  no more images")
    finally:
        arm.brake()
    return written_poses(taken, folder)


def _image_at_rest(
    driver: Driver, arm: DrivenArm, name: str, camera: str, newest: list[Sample]
) -> tuple[ImageArray, FloatArray]:
    """Hold the arm until an image was exposed at rest; return it, and the joints (n,) then."""
    stops = Stops()
    for _ in range(round(_IMAGE_S * driver.inner_rate_hz)):
        arm.step()
        stops.add(newest[0].joints[name])
        for frame in newest[0].frames:
            if frame.camera == camera and frame.image is not None and stops.is_new(frame, name):
                return frame.image, frame.joints[name]
    raise DriverSilent(f"no image of {camera} came while the arm was at rest")
