"""`vergence calibrate`: lens and mounting of a camera from images of a board."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from vergence.app.output import FAILURE, SUCCESS, confirmed, emit, new_folder, say
from vergence.errors import NOTHING, InputError, nearest

if TYPE_CHECKING:
    from vergence.app.calibration.dataset import Dataset
    from vergence.app.calibration.estimates import Estimate
    from vergence.app.calibration.synthetic import Truth
    from vergence.app.options import CalibrateOptions
    from vergence.arrays import FloatArray
    from vergence.camera import Camera
    from vergence.camera.calibration import (
        BadImage,
        CalibrationFailure,
        LensFit,
        MountingFit,
    )
    from vergence.cell import Cell
    from vergence.vision import Board


class Calibration(NamedTuple):
    """What came of it."""

    data: "Dataset"
    truth: "Truth | None"
    lens: "LensFit"
    mounting: "MountingFit | None"

    @property
    def camera(self) -> "Camera":
        """The camera as far as all data tell."""
        return self.lens.camera if self.mounting is None else self.mounting.camera

    @property
    def bad(self) -> "tuple[BadImage, ...]":
        """All images that were left out."""
        more = () if self.mounting is None else self.mounting.bad
        return self.data.blank + self.lens.bad + more

    @property
    def warnings(self) -> list[str]:
        """What to know before trusting it."""
        return self.lens.warnings + ([] if self.mounting is None else self.mounting.warnings)

    @property
    def estimates(self) -> "list[Estimate]":
        """The numbers of the result."""
        from vergence.app.calibration.estimates import lens_estimates, mounting_estimates

        if self.mounting is None:
            return lens_estimates(self.lens, self.truth)
        return [
            *lens_estimates(self.mounting, self.truth),
            *mounting_estimates(self.mounting, self.truth),
        ]


def calibrate(options: "CalibrateOptions") -> int:
    """Calibrate, write what a cell file reads, and say how well it is known.

    Raises:
        InputError: if what was asked or given cannot be used.
    """
    from vergence.app.calibration.files import CAMERA, TABLE, write_results
    from vergence.app.calibration.page import write_calibration_page
    from vergence.app.progress import working

    _require_one_source(options)
    _require_lens(options.lens)
    _require_deviation(options.square_deviation)
    T_world_base = _base(options)
    name = options.synthetic or str(options.images or options.cell)
    folder = options.out or new_folder(f"calibrate-{Path(name).stem or 'images'}")
    if not options.overwrite and any((folder / made).exists() for made in (CAMERA, TABLE)):
        given = f"{folder}, which holds a calibration"
        raise InputError("calibrate", "--out", given, "another folder, or --overwrite")
    folder.mkdir(parents=True, exist_ok=True)
    data, truth = _data(options, folder)
    if truth is not None:
        T_world_base = truth.T_world_base
    with working("calibrating"):
        found = _calibrated(options, data, truth)
    if not isinstance(found, Calibration):
        return _failed(found, data, options.as_json)
    camera = options.watch or "camera"
    write_results(folder, found.camera, found.mounting, T_world_base, camera)
    with working("drawing"):
        report = write_calibration_page(folder, name, found)
    files = {"camera": folder / CAMERA, "table": folder / TABLE, "report": report}
    emit(_answer(found, files)) if options.as_json else _tell(found, files)
    return SUCCESS


def _require_one_source(options: "CalibrateOptions") -> None:
    from vergence.runtime.bags import is_bag

    sources = options.images, options.synthetic, options.driver
    count = sum(source is not None for source in sources)
    if count != 1:
        given = "several of them" if count else NOTHING
        allowed = "a folder of images, a ROS 2 bag, --synthetic CELL, or --driver NAME --cell CELL"
        raise InputError("calibrate", "", given, allowed)
    if options.driver and not options.cell:
        allowed = "only together with --cell CELL, or with --latency CELL or --mounting CELL"
        raise InputError("calibrate", "--driver", options.driver, allowed)
    bag = options.images is not None and is_bag(options.images)
    for key, given_too, fits in (
        ("--topic", options.topic, bag),
        ("--joints", options.joints, bag),
        ("--cell", options.cell, bag or options.driver is not None),
    ):
        if given_too and not fits:
            raise InputError("calibrate", key, given_too, "only with a ROS 2 bag")
    if options.joints and not options.cell:
        allowed = "--cell too: the cell whose arm has these joints"
        raise InputError("calibrate", "--joints", options.joints, allowed)
    if options.move and options.driver is None:
        allowed = "only together with --driver NAME --cell CELL"
        raise InputError("calibrate", "--move", True, allowed)
    if options.yes and not options.move:
        raise InputError("calibrate", "--yes", True, "only together with --move")
    if options.projected and options.synthetic is None:
        raise InputError("calibrate", "--projected", True, "with --synthetic CELL")
    if options.watch and options.synthetic is None and options.driver is None:
        allowed = "with --synthetic CELL or --driver NAME"
        raise InputError("calibrate", "--watch", options.watch, allowed)


def _require_lens(lens: str) -> None:
    from vergence.camera.calibration import MODELS

    if lens not in MODELS:
        raise InputError("calibrate", "--lens", lens, nearest(lens, MODELS))


def _require_deviation(percent: float) -> None:
    if not 0.0 <= percent <= 20.0:
        raise InputError("calibrate", "--square-deviation", percent, "0 … 20, in percent")


def _base(options: "CalibrateOptions") -> "FloatArray":
    import numpy as np

    from vergence.geometry import rpy_to_matrix, se3
    from vergence.tables import numbers

    if options.base is None:
        return np.eye(4)
    values = numbers(
        {"--base": options.base.replace(",", " ").split()}, "--base", (6,), "vergence calibrate"
    )
    T: FloatArray = se3(rpy_to_matrix(np.deg2rad(values[:2:-1].copy())), values[:3].copy())
    return T


def _data(options: "CalibrateOptions", folder: Path) -> "tuple[Dataset, Truth | None]":
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
        image_folder.mkdir(exist_ok=True)
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
        raise InputError("calibrate", "--board", None, "COLUMNSxROWS of the board")
    cell = load_cell(str(options.cell), overrides(options.settings))
    camera = options.watch or cell.task.camera
    if camera not in cell.cameras:
        raise InputError("calibrate", "--watch", camera, nearest(camera, cell.cameras))
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
    """Refuse to drive an arm that does not carry the camera, or that nobody agreed to move."""
    arm = cell.task.arm
    if cell.cameras[camera].arm != arm:
        allowed = f"a camera that {arm} carries; without --move you move the arm yourself"
        raise InputError("calibrate", "--move", f"camera {camera}", allowed)
    question = (
        f"{arm} will move by itself, slowly, around the board it sees now. Is it free? [y/N] "
    )
    if not agreed and not confirmed(question):
        raise InputError("calibrate", "--move", NOTHING, "y, or --yes")


def _empty_folder(folder: Path) -> Path:
    """Make a folder for images, without those of an earlier calibration."""
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.png"):
        old.unlink()
    return folder


def _calibrated(
    options: "CalibrateOptions", data: "Dataset", truth: "Truth | None"
) -> "Calibration | CalibrationFailure":
    import numpy as np

    from vergence.camera import read_camera
    from vergence.camera.calibration import (
        CalibrationFailure,
        fit_lens,
        fit_mounting,
        free_parameters,
    )
    from vergence.camera.calibration.from_folder import with_reason

    file = options.camera
    known = None if file is None else read_camera(file, data.width, data.height)
    lens = fit_lens(data.sightings, data.width, data.height, options.lens, known)
    if isinstance(lens, CalibrationFailure):
        return with_reason(lens, data.blank)
    if data.T_base_flange is None:
        return Calibration(data, truth, lens, None)
    arm = {s.name: T for s, T in zip(data.sightings, data.T_base_flange, strict=True)}
    mounting = fit_mounting(
        [data.board.orientations(seen) for seen in lens.sightings],
        np.array([arm[seen.name] for seen in lens.sightings]),
        lens.camera,
        lens.noise_px,
        fixed=options.fixed if truth is None else truth.fixed,
        free=None if known else free_parameters(options.lens),
        scale_deviation=options.square_deviation / 100.0,
        rng=np.random.default_rng(options.seed),
    )
    if isinstance(mounting, CalibrationFailure):
        return mounting
    return Calibration(data, truth, lens, mounting)


def _failed(failure: "CalibrationFailure", data: "Dataset", as_json: bool) -> int:
    if as_json:
        emit(
            {
                "command": "calibrate",
                "outcome": {"kind": "failed", "reason": failure.reason},
                "left_out": _left_out(data.blank),
            }
        )
        return FAILURE
    say(f"no calibration: {failure}")
    _tell_left_out(data.blank)
    return FAILURE


def _left_out(bad: "Sequence[BadImage]") -> list[dict[str, Any]]:
    return [{"image": b.name, "residual_px": b.residual_px, "reason": b.reason} for b in bad]


def _answer(found: Calibration, files: dict[str, Path]) -> dict[str, Any]:
    from vergence.app.calibration.estimates import rotation_error_deg

    c, mounting = found.camera, found.mounting
    answer: dict[str, Any] = {
        "command": "calibrate",
        "outcome": {"kind": "completed", "reason": ""},
        "images": len(found.data.sightings) + len(found.data.blank),
        "used": len(found.lens.sightings if mounting is None else mounting.sightings),
        "left_out": _left_out(found.bad),
        "warnings": found.warnings,
        "rms_px": found.lens.rms_px,
        "noise_px": found.lens.noise_px,
        "left_out_rms_px": float(found.lens.left_out_px.mean()),
        "intrinsics": {
            "width": c.width,
            "height": c.height,
            "matrix": c.matrix.tolist(),
            "distortion": c.distortion.tolist(),
        },
        "estimates": [{**e._asdict(), "error": e.error} for e in found.estimates],
    }
    if mounting is not None:
        answer["mounting"] = {
            "fixed": mounting.fixed,
            "T_mount_camera": mounting.T_mount_camera.tolist(),
            "T_mount_board": mounting.T_mount_board.tolist(),
            "board_scale": mounting.board_scale,
            "board_scale_deviation": float(mounting.deviations[-1]),
            "rms_px": mounting.rms_px,
            "arm_noise_m": mounting.noise.arm_m,
            "arm_noise_rad": mounting.noise.arm_rad,
            "left_out_rms_px": float(mounting.left_out_px.mean()),
            "left_out_m": float(mounting.left_out_m.mean()),
            "left_out_rad": float(mounting.left_out_rad.mean()),
        }
        if found.truth is not None:
            answer["mounting"]["rotation_error_deg"] = rotation_error_deg(mounting, found.truth)
    return {**answer, **files}


def _tell(found: Calibration, files: dict[str, Path]) -> None:
    lens, mounting = found.lens, found.mounting
    say(
        f"{len(lens.sightings)} images of the board · residual {lens.rms_px:.3f} px · "
        f"an image left out {lens.left_out_px.mean():.3f} px"
    )
    if mounting is not None:
        import numpy as np

        where = "fixed camera" if mounting.fixed else "camera on the arm"
        say(
            f"{where}, {len(mounting.sightings)} poses · residual {mounting.rms_px:.3f} px · a "
            f"pose left out {mounting.left_out_px.mean():.3f} px, "
            f"{1e3 * mounting.left_out_m.mean():.2f} mm, "
            f"{np.rad2deg(mounting.left_out_rad.mean()):.3f}° · arm poses good to "
            f"{1e3 * mounting.noise.arm_m:.2f} mm, {np.rad2deg(mounting.noise.arm_rad):.3f}°"
        )
        if mounting.scale_deviation > 0.0:
            percent = 100.0 * mounting.board_scale
            say(
                f"board {percent:.2f} ± {percent * mounting.deviations[-1]:.2f} % of the size given"
            )
    say()
    for line in _table(found):
        say(line)
    say()
    _tell_left_out(found.bad)
    for words in found.warnings:
        say(f"  warning: {words}")
    say(f"  camera  {files['camera']}  (calibration = … in a cell file, or --camera of track)")
    say(f"  table   {files['table']}  (to paste into a cell file)")
    say(f"  report  {files['report']}")


def _table(found: Calibration) -> list[str]:
    truth = found.truth is not None
    heads = ("", "estimate", "deviation", "leaving out", *(("truth", "error") if truth else ()), "")
    rows = [heads]
    for e in found.estimates:
        values = (e.value, e.deviation, e.jackknife, *((e.truth, e.error) if truth else ()))
        rows.append((e.name, *(e.words(value) for value in values), e.unit))
    widths = [max(len(row[n]) for row in rows) for n in range(len(heads))]
    return [
        "  "
        + "  ".join(
            cell.rjust(w) if n else cell.ljust(w)
            for n, (cell, w) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def _tell_left_out(bad: "Sequence[BadImage]") -> None:
    for image in bad:
        size = "" if image.residual_px != image.residual_px else f" ({image.residual_px:.2f} px)"
        say(f"  left out: {image.name}{size}: {image.reason}")
