"""Where the images and poses of a calibration come from: a folder, a bag, a robot, simulation."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from vergence.app.output import confirmed
from vergence.errors import NOTHING, InputError, nearest

if TYPE_CHECKING:
    from vergence.app.calibration.dataset import Dataset
    from vergence.app.calibration.synthetic import Truth
    from vergence.app.options import CalibrateOptions
    from vergence.cell import Cell
    from vergence.vision import Board


def calibration_data(options: "CalibrateOptions", folder: Path) -> "tuple[Dataset, Truth | None]":
    """Return the images of a board that the options name, and the truth where it is simulated.

    Raises:
        InputError: if what was asked or given cannot be used.
    """
    from vergence.app.calibration.dataset import board_of_options, read_dataset
    from vergence.runtime.bags import is_bag

    if options.synthetic is None:
        board = board_of_options(
            options.board,
            options.square_mm,
            options.marker_mm,
            options.dictionary,
            options.pattern,
        )
        if options.images is None:
            return _robot_data(options, board, folder), None
        if is_bag(options.images):
            return _bag_data(options, options.images, board, folder), None
        return read_dataset(options.images, board, options.poses), None
    from vergence.app.calibration.synthetic import Studio, make_data

    with tempfile.TemporaryDirectory() as models:
        charuco = not options.chessboard
        studio = Studio(options.synthetic, options.watch, charuco, Path(models), options.seed)
        if options.projected:
            return make_data(studio, options.image_count, None, options.noise_px)
        image_folder = folder / "images"
        image_folder.mkdir(parents=True, exist_ok=True)
        _, truth = make_data(studio, options.image_count, image_folder, options.noise_px)
        return read_dataset(image_folder, None, None), truth


def _bag_data(
    options: "CalibrateOptions", bag: Path, board: "Board | None", folder: Path
) -> "Dataset":
    """Write the images and poses of a bag beside the results, and read them."""
    from vergence.app.calibration.dataset import read_dataset
    from vergence.app.calibration.from_bag import ArmOfBag, write_bag_images
    from vergence.vision.board_file import BOARD, read_board

    board = board or read_board(bag / BOARD)
    images = _empty_folder(folder / "images")
    arm = ArmOfBag(options.cell, options.joints) if options.cell else None
    poses = write_bag_images(bag, options.topic, arm, images)
    return read_dataset(images, board, options.poses or poses)


def _robot_data(options: "CalibrateOptions", board: "Board | None", folder: Path) -> "Dataset":
    """Take images and poses from a robot into a folder beside the results, and read them."""
    from vergence.app.calibration.dataset import read_dataset
    from vergence.app.calibration.driven_images import drive_for_images
    from vergence.app.calibration.from_robot import take_robot_images
    from vergence.app.run import overrides
    from vergence.assembly import open_driver
    from vergence.cell import load_cell

    if board is None:
        raise InputError("vergence calibrate", "--board", None, "COLUMNSxROWS of the board")
    cell = load_cell(str(options.cell), overrides(options.settings))
    camera = options.watch or cell.task.camera
    if camera not in cell.cameras:
        raise InputError("vergence calibrate", "--watch", camera, nearest(camera, cell.cameras))
    if options.move:
        _require_agreement(cell, camera, options.yes)
    images = _empty_folder(folder / "images")
    driver = open_driver(cell, str(options.driver), mounted_as_told=False)
    count = options.image_count
    try:
        if options.move:
            poses = drive_for_images(cell, driver, camera, board, count, images, options.seed)
        else:
            poses = take_robot_images(cell, driver, camera, count, images)
    finally:
        driver.close()
    return read_dataset(images, board, options.poses or poses)


def _require_agreement(cell: "Cell", camera: str, agreed: bool) -> None:
    """Refuse to drive an arm that does not carry the camera, or for which consent is missing."""
    arm = cell.task.arm
    if cell.cameras[camera].arm != arm:
        allowed = f"a camera that {arm} carries; without --move you move the arm yourself"
        raise InputError("vergence calibrate", "--move", f"camera {camera}", allowed)
    question = (
        f"{arm} will move by itself, slowly, around the board it sees now. Is it free? [y/N] "
    )
    if not agreed and not confirmed(question):
        raise InputError("vergence calibrate", "--move", NOTHING, "y, or --yes")


def _empty_folder(folder: Path) -> Path:
    """Make a folder for images, without those of an earlier calibration."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.png"):
        old.unlink()
    return folder
