"""The report of tracked footage: outcome, numbers, images, and values over time."""

import os
from collections.abc import Iterator, Mapping
from html import escape
from pathlib import Path
from urllib.parse import quote

from vergence.app import markup
from vergence.app.figures.tracked import (
    curve_chart,
    lapses,
    position_chart,
    rotation_chart,
    share_chart,
)
from vergence.app.overlay import DESIRED, FOUND, LOST, web_color
from vergence.app.report import REPORT
from vergence.app.tracking.drawing import AXES
from vergence.app.tracking.overlay_images import overlay_images
from vergence.app.tracking.track_record import (
    TrackedCurve,
    TrackedPose,
    TrackRecord,
    read_track,
)
from vergence.app.tracking.track_rows import (
    curve_rows,
    footage_rows,
    pose_rows,
    remark_rows,
    sighting_rows,
)
from vergence.places import TRACK

_MOST_LISTED = 20  # stretches without the object or a curve
_FILES = {  # by the key of the answer: what is in it
    "poses": "pose and standard deviations, one row per image",
    "poses_with_covariance": "the same with covariances and unseen motions, one line per image",
    "ellipses": "values and standard deviations of ellipses, one row per image and curve",
    "lines": "values and standard deviations of lines, one row per image and curve",
    "regions": "values and standard deviations of regions, one row per image and curve",
    "marks": "values and standard deviations of marks, one row per image and curve",
    "curves_with_covariance": "all values with covariances, one line per image",
    "overlay": "the film in full size",
}


def _line(color: tuple[int, int, int]) -> str:
    return f'<path d="M1 8h14" stroke="{web_color(color)}" stroke-width="2.5"/>'


_POSE_MARKS = {
    "seen": _line(FOUND),
    "ambiguous or predicted": _line(DESIRED),
    "lost": _line(LOST),
    "searched for, not found": f'<circle cx="8" cy="8" r="3" fill="{web_color(LOST)}"/>',
    **{f"{name} axis": _line(color) for name, color in zip("xyz", AXES, strict=True)},
}
_CURVE_MARKS = {"found": _line(FOUND), "not found, where it was last": _line(LOST)}


def write_track_page(folder: Path, page: Path | None = None) -> Path:
    """Write the report of what `vergence track` has written; return where it is.

    Args:
        folder: of the track.
        page: file to write; in that folder if None.

    Raises:
        InputError: if a file of the track is missing or was changed.
    """
    record = read_track(folder)
    where = page or folder / REPORT
    where.write_text(make_track_page(record, where.parent), encoding="utf-8")
    return where


def make_track_page(record: TrackRecord, beside: Path) -> str:
    """Return the report as a page that needs nothing but itself; it links to the files.

    Args:
        record: what it is of.
        beside: folder that the page is for.
    """
    title = _title(record)
    parts = [
        markup.header("vergence track", title, markup.ending(record.outcome)),
        _summary(record),
        _images(record),
        *(_over_time(record) if len(record.time) > 1 else ()),
        _files(record, beside),
        _footer(record.answer),
        markup.script("report.js"),
    ]
    return markup.page(f"{title} · vergence track", "\n".join(filter(None, parts)))


def _title(record: TrackRecord) -> str:
    answer = record.answer
    what = ", ".join(curve.title for curve in record.curves)
    if answer.get("model"):
        what = Path(str(answer["model"])).name
    elif answer.get("tag"):
        what = f"tag {answer['tag']}"
    return f"{what} in {Path(str(answer.get('images'))).name}"


def _summary(record: TrackRecord) -> str:
    tables = [markup.table("Footage", footage_rows(record))]
    if record.pose is not None:
        tables += [
            markup.table("What the images show", sighting_rows(record, record.pose)),
            markup.table("Pose", pose_rows(record, record.pose)),
            markup.table("Remarks", remark_rows(record)),
        ]
    tables += [markup.table(_name(curve), curve_rows(record, curve)) for curve in record.curves]
    return markup.section("Summary", markup.cards(tables))


def _images(record: TrackRecord) -> str:
    images = overlay_images(record)
    ink = _CURVE_MARKS if record.pose is None else _POSE_MARKS
    film = markup.film(images.film, "the footage with what was found", markup.marks(ink))
    both = markup.beside(film, _lapses(record))
    return markup.section("Images", both, markup.stills(images.key_frames))


def _lapses(record: TrackRecord) -> str:
    """Return when and why there was no measurement, numbered as in the charts."""
    entries = [
        (
            f"{lapse.shade.start:.2f} to {lapse.shade.end:.2f} s",
            f"{lapse.curve} {lapse.shade.label}".strip(),
            lapse.shade.words,
        )
        for lapse in lapses(record)
    ]
    rest = len(entries) - _MOST_LISTED
    more = f"<p>The files below have {rest} more.</p>" if rest > 0 else ""
    told = markup.happenings(entries[:_MOST_LISTED]) or "<p>Found in every image.</p>"
    return f"<div><h3>Images without a measurement</h3>{told}{more}</div>"


def _over_time(record: TrackRecord) -> Iterator[str]:
    """Yield the sections with charts."""
    if record.pose is not None:
        yield _pose(record, record.pose)
    for curve in record.curves:
        yield _curve(record, curve)


def _pose(record: TrackRecord, pose: TrackedPose) -> str:
    where = markup.chart(
        position_chart(record, pose),
        "Position of the object's frame in the camera. The band is one standard deviation on "
        "either side; it is cut off at the edge of a panel.",
    )
    turned = markup.chart(
        rotation_chart(record, pose),
        "Rotation since the first image that shows the object, as a rotation vector along the "
        "camera's axes. It lies within ±180°; the file has absolute quaternions.",
    )
    share = markup.chart(share_chart(record, pose), "How much of the object each image showed.")
    return markup.section("Pose over time", where, turned, share)


def _curve(record: TrackRecord, curve: TrackedCurve) -> str:
    drawn = markup.chart(
        curve_chart(record, curve),
        "Values in the image, in pixels from the centre of the top left pixel, angles from u to "
        "v. The band is one standard deviation on either side.",
    )
    return markup.section(f"{_name(curve)} over time", drawn)


def _name(curve: TrackedCurve) -> str:
    return curve.title.capitalize()


def _files(record: TrackRecord, beside: Path) -> str:
    lines = "".join(
        f'<li><a href="{quote(Path(os.path.relpath(path, beside)).as_posix())}">'
        f"{escape(path.name)}</a>: {escape(words)}</li>"
        for path, words in _described(record.folder, record.answer)
    )
    return markup.section("Files", f"<ul>{lines}</ul>")


def _described(folder: Path, answer: Mapping[str, object]) -> Iterator[tuple[Path, str]]:
    for key, words in _FILES.items():
        if name := answer.get(key):
            yield folder / Path(str(name)).name, words
    yield folder / TRACK, "outcome and summary, as the option --json prints them"


def _footer(answer: Mapping[str, object]) -> str:
    """Return what has made the page, with the options that it was given."""
    options = answer.get("options")
    given = options.items() if isinstance(options, Mapping) else ()
    words = [
        f"vergence track {answer.get('images')}",
        *(f"--{key} {value}" for key, value in given),
    ]
    version = escape(str(answer.get("vergence", "")))
    return f"<footer>Made by vergence {version}: {escape(' '.join(words))}</footer>"
