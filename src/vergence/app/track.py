"""`vergence track`: the pose of a known object in footage, image by image."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vergence.app.output import FAILURE, SUCCESS, emit, new_folder, say
from vergence.signals import Outcome, OutcomeKind

if TYPE_CHECKING:
    from vergence.app.options import TrackOptions
    from vergence.app.tracking.footage import Footage, FootageFrame
    from vergence.app.tracking.tag_follower import TagFollower
    from vergence.arrays import ImageArray
    from vergence.camera import Camera
    from vergence.cell.schema import TagTable
    from vergence.estimation.hypothesis_follower import HypothesisFollower
    from vergence.estimation.object_follower import FollowRule, ObjectTracker, Step
    from vergence.vision.known_object import ObjectModel

_NO_SAMPLES: dict[str, Any] = {
    "samples_px": np.zeros((0, 2)),
    "samples_found": np.zeros(0, dtype=np.bool_),
}
_KEY_FRAMES = 6  # spread over the footage
_TOLD_TURNS = 3
_MOST_KEY_FRAMES = 24  # with those where the sighting changes


class Tracked(NamedTuple):
    """How it went."""

    outcome: Outcome
    frames: int
    seen: int
    last: "Step"
    deviation_max_m: float  # largest standard deviation of the position while seen
    deviation_max_rad: float  # but for turns that no image shows
    median_ms: float  # an image, drawing and files left out
    free: str  # which turns no image shows; empty if there are none
    alike: tuple[str, ...]  # turns after which the object's edges are the same
    note: str  # which pose was taken instead of the given one; empty if none was


def track(options: "TrackOptions") -> int:
    """Follow an object through footage into a run folder; return the exit code."""
    from vergence.app.tracking.footage import open_footage

    tag = _tag(options)
    model = None if tag is not None else _model(options)
    footage = open_footage(options.images, options.rate, options.topic)
    frames = footage.frames()
    first = next(frames)
    camera = _camera(options, first)
    follower: HypothesisFollower | TagFollower
    if tag is not None:
        follower = _tag_follower(tag, camera)
    else:
        assert model is not None
        follower = _follower(options, model, camera, footage, first)
    folder = options.out or new_folder(f"track-{Path(options.images).stem or 'footage'}")
    folder.mkdir(parents=True, exist_ok=True)
    run = _Run(folder, footage, camera, follower, options.overlay)
    tracked = run.through(first, frames)
    files = run.files()
    if options.as_json:
        emit(_answer(options, tracked, files, folder))
    else:
        _tell(tracked, files, folder)
    return SUCCESS if tracked.outcome.succeeded else FAILURE


def _tag(options: "TrackOptions") -> "TagTable | None":
    """Return the tag that is followed, None for an object with a model.

    Raises:
        InputError: if it is not a tag, or is combined with options that do not apply to tags.
    """
    from vergence.app.tracking.tag_follower import tag_of_option
    from vergence.errors import InputError

    if options.tag is None:
        return None
    fields = type(options).__dataclass_fields__
    for key in ("model", "start", "scale", "contrast", "jolt", "share", "by"):
        if (given := getattr(options, key)) != fields[key].default:
            raise InputError("track", f"--{key}", given, "nothing together with --tag")
    return tag_of_option(options.tag)


def _tag_follower(tag: "TagTable", camera: "Camera") -> "TagFollower":
    from vergence.app.tracking.tag_follower import TagFollower

    return TagFollower(tag, camera)


def _model(options: "TrackOptions") -> "ObjectModel":
    """Return the object that is followed.

    Raises:
        InputError: if no model is given, or no start.
    """
    from vergence.errors import NOTHING, InputError
    from vergence.vision.known_object import load_object_model

    if options.model is None:
        raise InputError("track", "--model", NOTHING, "--model with --start, or --tag")
    if options.start is None:
        raise InputError("track", "--start", NOTHING, "the object's pose in the first image")
    return load_object_model(options.model, options.scale)


def _camera(options: "TrackOptions", first: "FootageFrame") -> "Camera":
    from vergence.app.tracking.intrinsics import camera_of_options
    from vergence.camera import read_camera
    from vergence.errors import InputError

    height, width = first.image.shape
    intrinsics = {"fx": options.fx, "fy": options.fy, "cx": options.cx, "cy": options.cy}
    if options.camera is None:
        return camera_of_options(intrinsics, options.distortion, width, height)
    for key, value in (*intrinsics.items(), ("distortion", options.distortion)):
        if value is not None:
            raise InputError("track", f"--{key}", value, "either --camera or intrinsics")
    return read_camera(options.camera, width, height)


def _follower(
    options: "TrackOptions",
    model: "ObjectModel",
    camera: "Camera",
    footage: "Footage",
    first: "FootageFrame",
) -> "HypothesisFollower":
    from vergence.app.tracking.start import starting_poses
    from vergence.errors import InputError
    from vergence.estimation.hypothesis_follower import HypothesisFollower
    from vergence.estimation.object_follower import LEAST_SHARE

    for key, value in (("--contrast", options.contrast), ("--jolt", options.jolt)):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError("track", key, value, "a number above zero")
    share = options.share
    if share is not None and not LEAST_SHARE <= share <= 1.0:
        reason = "with less, an object cannot be distinguished from its background"
        allowed = f"{LEAST_SHARE} … 1: {reason}"
        raise InputError("track", "--share", share, allowed)
    assert options.start is not None
    starts = starting_poses(options.start, camera)
    tracker, usual = _tracker(options, model, first)
    rule = replace(usual, jolt_px=options.jolt)
    if share is not None:
        rule = rule.with_least_share(share)
    return HypothesisFollower(tracker, camera, starts, 0.0, 1.0 / footage.rate_hz, rule)


def _tracker(
    options: "TrackOptions", model: "ObjectModel", first: "FootageFrame"
) -> "tuple[ObjectTracker, FollowRule]":
    """Return what measures the object, chosen by its model, and when an image counts."""
    from vergence.app.options.track import Modality
    from vergence.estimation.object_follower import OUTLINE_RULE, FollowRule
    from vergence.vision.known_object import EdgeTracker, SilhouetteTracker, shown_by_edges

    by_edges = options.by is Modality.EDGES or (
        options.by is Modality.AUTO and shown_by_edges(model)
    )
    if by_edges:
        return EdgeTracker(model, contrast=options.contrast), FollowRule()
    return SilhouetteTracker(model, 1 if first.color is None else 3), OUTLINE_RULE


class _Run:
    """One pass through footage, with everything it writes."""

    def __init__(
        self,
        folder: Path,
        footage: "Footage",
        camera: "Camera",
        follower: "HypothesisFollower | TagFollower",
        overlay: bool,
    ) -> None:
        from vergence.app.tracking.film import Film
        from vergence.app.tracking.results import PoseFiles

        self._folder, self._footage, self._overlay = folder, footage, overlay
        self._camera, self._follower = camera, follower
        self._poses = PoseFiles(folder)
        self._film = Film(folder / "overlay.webm", footage.rate_hz)
        self._key_frames: list[Path] = []

    def files(self) -> dict[str, Any]:
        """Return what was written."""
        return {
            "poses": self._poses.table,
            "poses_with_covariance": self._poses.lines,
            "overlay": self._film.path if self._film.written else None,
            "key_frames": self._key_frames,
        }

    def through(self, first: "FootageFrame", rest: Any) -> Tracked:
        """Follow the object to the end of the footage, or until one never seen is lost."""
        from itertools import chain

        from vergence.app.progress import bar
        from vergence.estimation.object_follower import Sighting

        steps: list[Step] = []
        took: list[float] = []
        progress = bar("{task.completed} / {task.total}")
        task = progress.add_task("prepare", total=self._footage.count or None)
        with progress, self._poses as poses, self._film:
            for number, frame in enumerate(chain((first,), rest)):
                began = perf_counter()
                step = self._follower.follow(self._image(frame), frame.time)
                took.append(perf_counter() - began)
                poses.add(Path(frame.name).name, step)
                self._draw(number, frame, step, steps[-1] if steps else None)
                steps.append(replace(step, **_NO_SAMPLES))  # a long film must fit in memory
                progress.update(task, completed=number + 1, description="track")
                if step.sighting is Sighting.LOST and not self._follower.was_seen:
                    break
            self._key_frame(len(steps) - 1, frame, step)
        return _summary(steps, took, self._follower)

    def _image(self, frame: "FootageFrame") -> "ImageArray":
        """Return the image as the tracker takes it."""
        from vergence.errors import InputError

        if not self._follower.in_color:
            return frame.image
        if frame.color is None:
            raise InputError(frame.name, "", "a grey image", "colour, as the first image")
        return frame.color

    def _draw(
        self, number: int, frame: "FootageFrame", step: "Step", before: "Step | None"
    ) -> None:
        from vergence.app.tracking.drawing import draw_step

        if self._overlay:
            self._film.add(
                draw_step(self._image(frame), step, self._follower.tracker, self._camera)
            )
        spacing = max(1, (self._footage.count or 600) // _KEY_FRAMES)
        changed = before is not None and before.sighting is not step.sighting
        if number % spacing == 0 or changed:
            self._key_frame(number, frame, step)

    def _key_frame(self, number: int, frame: "FootageFrame", step: "Step") -> None:
        import cv2

        from vergence.app.tracking.drawing import draw_step

        path = self._folder / f"frame-{number:06d}.jpg"
        if not self._overlay or path in self._key_frames:
            return
        if len(self._key_frames) < _MOST_KEY_FRAMES:
            canvas = draw_step(self._image(frame), step, self._follower.tracker, self._camera)
            path.write_bytes(bytes(cv2.imencode(".jpg", canvas)[1]))
            self._key_frames.append(path)


def _summary(
    steps: "list[Step]", took: list[float], follower: "HypothesisFollower | TagFollower"
) -> Tracked:
    from vergence.estimation.object_follower import Sighting

    seen = [step for step in steps if step.sighting is Sighting.SEEN]
    widest = np.max([step.deviation for step in seen], axis=0) if seen else np.full(2, np.nan)
    return Tracked(
        _outcome(steps),
        len(steps),
        len(seen),
        steps[-1],
        float(widest[0]),
        float(widest[1]),
        float(np.median(took)) * 1e3,
        follower.tracker.free,
        tuple(map(str, follower.symmetries)),
        follower.note,
    )


def _outcome(steps: "list[Step]") -> Outcome:
    """Return how it ended: whatever the last image does not show is not held."""
    from vergence.estimation.object_follower import Sighting

    last = steps[-1]
    if last.sighting is Sighting.SEEN:
        held = sum(step.sighting is Sighting.SEEN for step in steps)
        reason = f"the object was seen in {held} of {len(steps)} images, the last among them"
        return Outcome(OutcomeKind.COMPLETED, reason, last.time)
    reason = f"not seen at the end: {last.reason}"
    if last.sighting is Sighting.AMBIGUOUS:
        reason = f"ambiguous at the end: {last.reason}"
    if last.sighting is Sighting.LOST:
        before = [step.time for step in steps if step.sighting is Sighting.SEEN]
        since = f"last seen at {before[-1]:.2f} s" if before else "never seen"
        reason = f"{since}; {last.reason}"
    if last.share_decided:
        reason += " (--share lowers that)"
    return Outcome(OutcomeKind.TARGET_LOST, reason, last.time)


def _answer(
    options: "TrackOptions", tracked: Tracked, files: Mapping[str, Any], folder: Path
) -> dict[str, Any]:
    from vergence.app.tracking.results import pose_record

    outcome = tracked.outcome
    return {
        "command": "track",
        "images": options.images,
        "model": options.model,
        "tag": options.tag,
        "outcome": {
            "kind": outcome.kind.value,
            "reason": outcome.reason,
            "time": outcome.time,
        },
        "frames": tracked.frames,
        "seen": tracked.seen,
        "position_deviation_max_m": tracked.deviation_max_m,
        "rotation_deviation_max_deg": float(np.rad2deg(tracked.deviation_max_rad)),
        "median_ms": tracked.median_ms,
        "unseen_turns": tracked.free or None,
        "symmetries": tracked.alike,
        "note": tracked.note or None,
        "last": pose_record(tracked.last),
        "run": folder,
        **files,
    }


def _tell(tracked: Tracked, files: Mapping[str, Any], folder: Path) -> None:
    say(str(tracked.outcome))
    say(
        f"  seen in {tracked.seen} of {tracked.frames} images · standard deviation up to "
        f"{1e3 * tracked.deviation_max_m:.2g} mm, {np.rad2deg(tracked.deviation_max_rad):.2g}° · "
        f"{tracked.median_ms:.1f} ms per image"
    )
    if tracked.free:
        say(f"  {tracked.free}; its standard deviation is that of an unknown angle, 104°")
    say(f"  poses    {files['poses']}  (with covariances: {files['poses_with_covariance'].name})")
    if tracked.alike:
        say(f"  symmetric: its edges look the same turned by {_listed(tracked.alike)}")
    if tracked.note:
        say(f"  {tracked.note}")
    if files["overlay"]:
        say(f"  overlay  {files['overlay']}")
    say(f"  folder   {folder}")


def _listed(turns: tuple[str, ...]) -> str:
    """Return a few of the turns in words."""
    rest = len(turns) - _TOLD_TURNS
    return ", ".join(turns[:_TOLD_TURNS]) + (f" and {rest} others" if rest > 0 else "")
