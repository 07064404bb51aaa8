"""The page of a calibration: numbers with their uncertainty, residuals, coverage, images."""

from html import escape
from pathlib import Path

import numpy as np

from vergence.app import markup
from vergence.app.calibration.calibration import Calibration
from vergence.app.calibration.estimates import Estimate, rotation_error_deg
from vergence.app.figures.calibration import residual_bars_figure, residual_field_figure
from vergence.app.report import REPORT
from vergence.app.table import Row
from vergence.camera.calibration import coverage

_LENS = (
    "fx, fy: focal lengths; cx, cy: principal point, from the centre of the top left pixel; k1, "
    "k2, k3: radial distortion; p1, p2: tangential distortion."
)
_MOUNTING = " x, y, z, roll, pitch, yaw: pose of the camera in {mount}."
_ASSUMES = (
    "Deviations are standard deviations from the normal equations. They assume that the errors of "
    "corners are independent and as large as the residuals, that the board is flat and has the "
    "given size within its deviation, and that the lens follows the model; if arm poses are used, "
    "also that their errors are independent between images. “Leaving out” is the deviation "
    "estimated by leaving out each image in turn; if it is much larger, an assumption does not "
    "hold."
)


def write_calibration_page(folder: Path, name: str, found: Calibration) -> Path:
    """Write a page that needs nothing but itself into a folder; return where it is."""
    parts = [
        _header(name, found),
        markup.section("Result", _result(found), *_explained(found)),
        markup.section("How well it fits", markup.cards(_numbers(found))),
        markup.section("Left out", _left_out(found)),
        markup.section("Residuals", *_figures(found)),
    ]
    path = folder / REPORT
    text = markup.page(f"{name} · vergence calibrate", "\n".join(parts))
    path.write_text(text, encoding="utf-8")
    return path


def _header(name: str, found: Calibration) -> str:
    warnings = found.warnings
    words = "no warnings" if not warnings else f"warnings: {len(warnings)}"
    remarks = "".join(f"<li>{escape(text)}</li>" for text in warnings)
    return (
        '<header><span class="kicker">vergence calibrate</span>'
        f"<h1>{escape(name)}</h1><p>{markup.badge(words, not warnings)}{_bad(found)}</p>"
        + (f"<ul>{remarks}</ul>" if remarks else "")
        + "</header>"
    )


def _bad(found: Calibration) -> str:
    """Return how many images were not used; empty if all were."""
    count = len(found.bad)
    images = "one image was" if count == 1 else f"{count} images were"
    return markup.badge(f"{images} not used", False) if count else ""


def _result(found: Calibration) -> str:
    heads = ["", "estimate", "deviation", "leaving out", "truth", "error", "unit"]
    if found.truth is None:
        heads = [head for head in heads if head not in ("truth", "error")]
    head = "".join(f'<th scope="col" class="number">{text}</th>' for text in heads[:-1])
    head += f'<th scope="col">{heads[-1]}</th>'
    rows = "\n".join(_row(e, found.truth is not None) for e in found.estimates)
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table>"


def _explained(found: Calibration) -> list[str]:
    names = _LENS
    if found.mounting is not None:
        mount = "the arm's base" if found.mounting.fixed else "the arm's flange"
        names += _MOUNTING.format(mount=mount)
    return [f"<p>{escape(text)}</p>" for text in (names, _ASSUMES)]


def _row(e: Estimate, truth: bool) -> str:
    values = [e.value, e.deviation, e.jackknife, *((e.truth, e.error) if truth else ())]
    cells = "".join(f'<td class="number">{e.words(value)}</td>' for value in values)
    return f'<tr><th scope="row">{e.name}</th>{cells}<td class="unit">{e.unit}</td></tr>'


def _numbers(found: Calibration) -> list[str]:
    lens, mounting = found.lens, found.mounting
    covered = coverage(lens.sightings, found.data.width, found.data.height)
    rows = [
        Row("images", str(len(lens.sightings)), "", "with the board, kept"),
        Row(
            "residual", f"{lens.rms_px:.3f}", "px", "root mean square, image poses estimated freely"
        ),
        Row(
            "left out",
            f"{lens.left_out_px.mean():.3f}",
            "px",
            "an image, with the lens of all others",
        ),
        Row("coverage", f"{100 * covered:.0f}", "%", "of 8 × 6 fields with a corner"),
    ]
    cards = [markup.table("Lens", rows)]
    if mounting is None:
        return cards
    turned = " · ".join(f"{angle:.0f}" for angle in mounting.turning_deg)
    left_m, left_rad = mounting.left_out_m.mean(), mounting.left_out_rad.mean()
    rows = [
        Row("poses", str(len(mounting.sightings)), "", "kept"),
        Row("residual", f"{mounting.rms_px:.3f}", "px", "through the arm's poses"),
        Row("left out", f"{mounting.left_out_px.mean():.3f}", "px", "predicted by all others"),
        Row("left out, place", f"{1e3 * left_m:.3f}", "mm", "of the board's middle"),
        Row("left out, angle", f"{np.rad2deg(left_rad):.4f}", "°"),
        Row(
            "arm, position",
            f"{1e3 * mounting.noise.arm_m:.3f}",
            "mm",
            "error of its poses, estimated",
        ),
        Row("arm, rotation", f"{np.rad2deg(mounting.noise.arm_rad):.4f}", "°"),
        Row(
            "board",
            f"{100 * mounting.board_scale:.2f}",
            "%",
            f"of the size given, ± {100 * mounting.deviations[-1]:.2f}",
        ),
        Row("arm turned", turned, "°", "about three axes, root mean square between images"),
    ]
    if found.truth is not None:
        error = rotation_error_deg(mounting, found.truth)
        rows.append(Row("rotation error", f"{error:.4f}", "°", "against the truth"))
    return [*cards, markup.table("Mounting", rows)]


def _left_out(found: Calibration) -> str:
    rows = [
        Row(b.name, "–" if np.isnan(b.residual_px) else f"{b.residual_px:.2f}", "px", b.reason)
        for b in found.bad
    ]
    return markup.table("Images that were not used", rows)


def _figures(found: Calibration) -> list[str]:
    lens, mounting = found.lens, found.mounting
    figures = [
        markup.figure(
            residual_field_figure(lens.camera, lens.sightings, lens.residuals),
            "Where corners were found, and how far each is from where the fitted lens puts it. "
            "Arrows that agree with their neighbours show a lens that the model does not describe, "
            "or a bent board.",
        ),
        markup.figure(
            residual_bars_figure(lens.sightings, lens.residuals, lens.left_out_px),
            "Residuals of the lens, image by image; each image's pose is its own.",
        ),
    ]
    if mounting is not None:
        figures.append(
            markup.figure(
                residual_bars_figure(mounting.sightings, mounting.residuals, mounting.left_out_px),
                "Residuals through the arm's poses, image by image.",
            )
        )
    return figures
