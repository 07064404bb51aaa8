"""The result of `vergence calibrate`, as text and as JSON."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vergence.app.calibration.calibration import Calibration
from vergence.app.calibration.dataset import Dataset
from vergence.app.calibration.estimates import rotation_error_deg
from vergence.app.output import FAILURE, emit, say
from vergence.camera.calibration import BadImage, CalibrationFailure


def tell_failure(failure: CalibrationFailure, data: Dataset, as_json: bool) -> int:
    """Print why there is no calibration; return the exit code."""
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


def _left_out(bad: Sequence[BadImage]) -> list[dict[str, Any]]:
    return [{"image": b.name, "residual_px": b.residual_px, "reason": b.reason} for b in bad]


def answer(found: Calibration, files: dict[str, Path]) -> dict[str, Any]:
    """Return the result as `--json` prints it."""
    c, mounting = found.camera, found.mounting
    fields: dict[str, Any] = {
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
        fields["mounting"] = {
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
            fields["mounting"]["rotation_error_deg"] = rotation_error_deg(mounting, found.truth)
    return {**fields, **files}


def tell(found: Calibration, files: dict[str, Path]) -> None:
    """Print the result and where it was written."""
    lens, mounting = found.lens, found.mounting
    say(
        f"{len(lens.sightings)} images of the board · residual {lens.rms_px:.3f} px · "
        f"an image left out {lens.left_out_px.mean():.3f} px"
    )
    if mounting is not None:
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


def _tell_left_out(bad: Sequence[BadImage]) -> None:
    for image in bad:
        size = "" if image.residual_px != image.residual_px else f" ({image.residual_px:.2f} px)"
        say(f"  left out: {image.name}{size}: {image.reason}")
