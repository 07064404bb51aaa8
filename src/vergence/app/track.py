"""`vergence track`: an object, a tag or curves in footage, image by image."""

from collections.abc import Iterator, Mapping
from importlib import import_module
from importlib.metadata import version
from itertools import chain
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vergence.app.output import FAILURE, SUCCESS, emit, page_folder, say
from vergence.errors import NOTHING, InputError
from vergence.places import TRACK

if TYPE_CHECKING:
    from vergence.app.options import TrackOptions
    from vergence.app.tracking.footage import Footage, FootageFrame
    from vergence.app.tracking.overlay_files import OverlayFiles
    from vergence.app.tracking.track_subject import Start, Subject
    from vergence.arrays import ImageArray
    from vergence.runtime.interrupt import Interrupt
    from vergence.signals import Outcome

_CAMERA = frozenset(("camera", "fx", "fy", "cx", "cy", "distortion"))
_ALWAYS = frozenset(("images", "topic", "rate", "overlay", "out", "as_json"))
_ELSEWHERE = frozenset(("images", "overlay", "out", "as_json"))  # not about what is followed
# What can be followed, by the option that names it: the module whose function `prepare` begins it,
# and the options that apply.
_SUBJECTS = {
    "tag": ("tag_start", _CAMERA),
    "curve": ("curve_start", frozenset(("contrast", "jolt", "share"))),
    "model": (
        "object_start",
        _CAMERA | {"start", "scale", "contrast", "jolt", "share", "by"},
    ),
}


def track(options: "TrackOptions") -> int:
    """Follow what the options name through footage into a run folder; return the exit code."""
    from vergence.app.tracking.footage import open_footage
    from vergence.app.tracking.overlay_files import OverlayFiles
    from vergence.runtime.interrupt import Interrupt
    from vergence.runtime.recording import outcome_json

    folder = page_folder(options.out, f"track-{Path(options.images).stem or 'footage'}")
    start = _prepare(options)
    footage = open_footage(options.images, options.rate, options.topic)
    frames = footage.frames()
    first = next(frames)
    subject = start(footage, first)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / TRACK).unlink(missing_ok=True)  # it is not about what is written now
    overlay = OverlayFiles(folder, footage, subject, options.overlay)
    with subject.writing(folder), overlay, Interrupt() as interrupt:
        followed = _follow(subject, footage, chain((first,), frames), overlay, interrupt)
    outcome, answer, lines = subject.result(followed.median_ms)
    if followed.interrupted:
        outcome = _stopped(outcome, interrupt.reason, answer["frames"], footage.count)
    files = {**subject.files, **overlay.files}
    if not options.as_json:
        say(str(outcome))  # at once: the report is written later
        for line in (*lines, *_places(files)):
            say(f"  {line}")
    answer = {**_asked(options), "outcome": outcome_json(outcome), **answer}
    report = _reported(options, {**answer, **_names(files)}, folder)
    if options.as_json:
        emit({**answer, "run": folder, **files, "report": report})
    else:
        say(f"  report   {report}")
        say(f"  folder   {folder}")
    return SUCCESS if outcome.succeeded else FAILURE


def _reported(options: "TrackOptions", answer: Mapping[str, Any], folder: Path) -> Path:
    """Write the answer and the report beside what was tracked; return where the report is."""
    from vergence.app.progress import working
    from vergence.app.tracking.track_page import write_track_page
    from vergence.app.tracking.track_record import write_answer

    write_answer(folder, {**answer, "options": _given(options), "vergence": version("vergence")})
    with working("writing the report"):
        return write_track_page(folder)


def _names(files: Mapping[str, Any]) -> dict[str, Any]:
    """Return the names of files in their folder."""
    return {
        key: [one.name for one in file] if isinstance(file, list) else file and file.name
        for key, file in files.items()
    }


def _given(options: "TrackOptions") -> dict[str, str]:
    """Return the options that were given, beside where to write what."""
    fields = type(options).__dataclass_fields__
    given = {key: getattr(options, key) for key in fields if key not in _ELSEWHERE}
    return {
        key: f" --{key} ".join(value) if isinstance(value, list) else str(value)
        for key, value in given.items()
        if value != fields[key].default
    }


def _prepare(options: "TrackOptions") -> "Start":
    """Read what is to be followed.

    Raises:
        InputError: if nothing is named, or an option does not apply to it.
    """
    named = next((key for key in _SUBJECTS if getattr(options, key)), None)
    if named is None:
        raise InputError(
            "vergence track", "--model", NOTHING, "--model with --start, --tag, or --curve"
        )
    module, own = _SUBJECTS[named]
    for key, field in type(options).__dataclass_fields__.items():
        given = getattr(options, key)
        if key not in _ALWAYS | own | {named} and given != field.default:
            shown = ", ".join(given) if isinstance(given, list) else given
            raise InputError("vergence track", f"--{key}", shown, f"only without --{named}")
    start: Start = import_module(f"vergence.app.tracking.{module}").prepare(options)
    return start


class _Followed(NamedTuple):
    """How the footage was gone through."""

    median_ms: float  # that finding it in an image took
    interrupted: bool  # whether the user ended it before the footage did


def _follow(
    subject: "Subject",
    footage: "Footage",
    frames: "Iterator[FootageFrame]",
    overlay: "OverlayFiles",
    interrupt: "Interrupt",
) -> _Followed:
    """Follow to the end of the footage, or until it is given up or interrupted."""
    from vergence.app.progress import bar

    took: list[float] = []
    progress = bar("{task.completed} / {task.total}")
    task = progress.add_task("prepare", total=footage.count or None)
    with progress:
        frame = next(frames, None)
        while frame is not None:
            image, number = _image(subject, frame), len(took)
            began = perf_counter()
            subject.follow(image, frame.time)
            took.append(perf_counter() - began)
            subject.write(Path(frame.name).name)
            interrupted = interrupt.asked
            frame = None if interrupted or subject.given_up else next(frames, None)
            overlay.add(number, image, last=frame is None)
            progress.update(task, completed=len(took), description="track")
    return _Followed(float(np.median(took)) * 1e3, interrupted)


def _stopped(outcome: "Outcome", why: str, done: int, count: int) -> "Outcome":
    """Return the outcome of footage that was left after some of its images; 0 if not known."""
    from vergence.signals import Outcome, OutcomeKind

    reason = f"{why} after {done} of {count} images" if count else f"{why} after {done} images"
    if not outcome.succeeded:
        reason += f"; {outcome.kind.value} by then: {outcome.reason}"
    return Outcome(OutcomeKind.STOPPED, reason, outcome.time)


def _image(subject: "Subject", frame: "FootageFrame") -> "ImageArray":
    """Return the image as the subject takes it."""
    if not subject.in_color:
        return frame.image
    if frame.color is None:
        raise InputError(frame.name, "", "a grey image", "colour, as the first image")
    return frame.color


def _asked(options: "TrackOptions") -> dict[str, Any]:
    return {"command": "track", "images": options.images} | {
        key: getattr(options, key) for key in ("model", "tag", "curve")
    }


def _places(files: Mapping[str, Any]) -> Iterator[str]:
    """Yield the line that tells of the film, if there is one."""
    if files["overlay"]:
        yield f"overlay  {files['overlay']}"
