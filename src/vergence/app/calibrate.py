"""`vergence calibrate`: lens and mounting of a camera from images of a board."""

from pathlib import Path
from typing import TYPE_CHECKING

from vergence.app.output import SUCCESS, emit, page_folder
from vergence.errors import NOTHING, InputError, nearest

if TYPE_CHECKING:
    from vergence.app.calibration.calibration import Calibration
    from vergence.app.calibration.dataset import Dataset
    from vergence.app.calibration.synthetic import Truth
    from vergence.app.options import CalibrateOptions
    from vergence.arrays import FloatArray
    from vergence.camera.calibration import CalibrationFailure


def calibrate(options: "CalibrateOptions") -> int:
    """Calibrate, write files for a cell, and print how accurate they are.

    Raises:
        InputError: if what was asked or given cannot be used.
    """
    from vergence.app.calibration.files import CAMERA, TABLE, write_results
    from vergence.app.calibration.page import write_calibration_page
    from vergence.app.calibration.sources import calibration_data
    from vergence.app.calibration.summary import answer, tell, tell_failure
    from vergence.app.progress import working
    from vergence.camera import read_camera
    from vergence.camera.calibration import CalibrationFailure

    _require_one_source(options)
    _require_lens(options.lens)
    _require_deviation(options.square_deviation)
    if options.camera is not None:
        read_camera(options.camera)
    T_world_base = _base(options)
    name = options.synthetic or str(options.images or options.cell)
    folder = page_folder(options.out, f"calibrate-{Path(name).stem or 'images'}")
    if not options.overwrite and any((folder / made).exists() for made in (CAMERA, TABLE)):
        given = f"{folder}, which holds a calibration"
        raise InputError("vergence calibrate", "--out", given, "another folder, or --overwrite")
    data, truth = calibration_data(options, folder)
    if truth is not None:
        T_world_base = truth.T_world_base
    with working("calibrating"):
        found = _calibrated(options, data, truth)
    if isinstance(found, CalibrationFailure):
        return tell_failure(found, data, options.as_json)
    camera = options.watch or "camera"
    folder.mkdir(parents=True, exist_ok=True)
    write_results(folder, found.camera, found.mounting, T_world_base, camera)
    with working("drawing"):
        report = write_calibration_page(folder, name, found)
    files = {"camera": folder / CAMERA, "table": folder / TABLE, "report": report}
    emit(answer(found, files)) if options.as_json else tell(found, files)
    return SUCCESS


def _require_one_source(options: "CalibrateOptions") -> None:
    from vergence.runtime.bags import is_bag

    sources = options.images, options.synthetic, options.driver
    count = sum(source is not None for source in sources)
    if count != 1:
        given = "several of them" if count else NOTHING
        allowed = "a folder of images, a ROS 2 bag, --synthetic CELL, or --driver NAME --cell CELL"
        raise InputError("vergence calibrate", "", given, allowed)
    if options.driver and not options.cell:
        allowed = "only together with --cell CELL, or with --latency CELL or --mounting CELL"
        raise InputError("vergence calibrate", "--driver", options.driver, allowed)
    bag = options.images is not None and is_bag(options.images)
    for key, given_too, fits in (
        ("--topic", options.topic, bag),
        ("--joints", options.joints, bag),
        ("--cell", options.cell, bag or options.driver is not None),
    ):
        if given_too and not fits:
            raise InputError("vergence calibrate", key, given_too, "only with a ROS 2 bag")
    if options.joints and not options.cell:
        allowed = "--cell too: the cell whose arm has these joints"
        raise InputError("vergence calibrate", "--joints", options.joints, allowed)
    if options.move and options.driver is None:
        allowed = "only together with --driver NAME --cell CELL"
        raise InputError("vergence calibrate", "--move", True, allowed)
    if options.yes and not options.move:
        raise InputError("vergence calibrate", "--yes", True, "only together with --move")
    if options.projected and options.synthetic is None:
        raise InputError("vergence calibrate", "--projected", True, "with --synthetic CELL")
    if options.watch and options.synthetic is None and options.driver is None:
        allowed = "with --synthetic CELL or --driver NAME"
        raise InputError("vergence calibrate", "--watch", options.watch, allowed)


def _require_lens(lens: str) -> None:
    from vergence.camera.calibration import MODELS

    if lens not in MODELS:
        raise InputError("vergence calibrate", "--lens", lens, nearest(lens, MODELS))


def _require_deviation(percent: float) -> None:
    if not 0.0 <= percent <= 20.0:
        raise InputError("vergence calibrate", "--square-deviation", percent, "0 … 20, in percent")


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


def _calibrated(
    options: "CalibrateOptions", data: "Dataset", truth: "Truth | None"
) -> "Calibration | CalibrationFailure":
    import numpy as np

    from vergence.app.calibration.calibration import Calibration
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
