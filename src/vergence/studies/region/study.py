"""How well objects without sharp edges are followed by their outline: rendered films with truth."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.drawing import COLORS, figure, legend, logarithmic
from vergence.estimation.known_object.object_follower import (
    OUTLINE_RULE,
    ObjectFollower,
    Sighting,
    Step,
)
from vergence.experiments.workers import Workers
from vergence.geometry import moved_pose, pose_difference
from vergence.studies.check import Check, Progress, StudyResult, within
from vergence.studies.figure_files import save_figures
from vergence.studies.honesty.answer import deviations_of
from vergence.studies.region.films import CAMERA, RATE_HZ, film
from vergence.studies.region.objects import OBJECTS
from vergence.vision.known_object import ObjectModel, SilhouetteTracker

TITLE = "Objects without sharp edges, followed by their outline"
# How much of the object's width the occluder covers, and by which share the light changes.
CONDITIONS = {"clutter": (0.0, 0.0), "light": (0.0, 0.4), "hidden": (0.4, 0.4)}
FRAMES, QUICK_FRAMES = 60, 12
_QUICK_OBJECTS = 2
_START = (0.002, 0.015)  # of the first pose: m and rad, standard deviation along each axis
_MOST_MM, _MOST_DEG = 5.0, 3.0  # of 95 of 100 images in which it is seen, at 0.45 m
_LEAST_SEEN = 0.95
_WRONG, _MOST_WRONG = 5.0, 1.0  # deviations; of a thousand images


class Followed(NamedTuple):
    """One image of a film, as followed."""

    object: str
    condition: str
    seen: bool
    reason: str  # why it is not seen
    error_mm: float  # of the position
    error_deg: float  # of the turns that show
    deviations: float  # how far the pose is from the truth, as deviations of one number
    hidden: float  # share of the object behind the occluder


def reproduce(
    out: Path, quick: bool, progress: Progress, seed: int = 0, imaging: str | None = None
) -> StudyResult:
    """Follow every object through a film of each condition, on every core.

    Args:
        out: folder for the figure.
        quick: two objects in short films.
        progress: called with the current step.
        seed: of colours, clutter, motion and first pose.
        imaging: of the camera, see `ImagingTable`.
    """
    objects = list(OBJECTS)[: _QUICK_OBJECTS if quick else None]
    films = [(name, condition) for name in objects for condition in CONDITIONS]
    frames = QUICK_FRAMES if quick else FRAMES
    with Workers() as pool:
        tried = pool.try_all(
            partial(_follow, films, frames, seed, imaging),
            len(films),
            lambda share: progress(f"{len(films)} films of {frames} images", share),
        )
    images = [image for followed in tried for image in followed]
    figures = save_figures(out, {"region": (_errors(images), _CAPTION)})
    return StudyResult(TITLE, checks_of(images), figures, seed)


def _follow(
    films: Sequence[tuple[str, str]], frames: int, seed: int, imaging: str | None, number: int
) -> list[Followed]:
    name, condition = films[number]
    kind = list(OBJECTS).index(name)
    return follow_film(name, condition, frames, np.random.default_rng([seed, kind]), imaging)


def follow_film(
    name: str,
    condition: str,
    frames: int,
    random: np.random.Generator,
    imaging: str | None = None,
) -> list[Followed]:
    """Follow an object through a film until it is lost; `imaging` is that of the camera."""
    mesh = OBJECTS[name]()
    tracker = SilhouetteTracker(ObjectModel.from_mesh(name, *mesh))
    hidden, light = CONDITIONS[condition]
    offset = np.repeat(_START, 3) * random.normal(size=6)
    follower: ObjectFollower | None = None
    images = []
    shown = film(mesh, int(random.integers(2**31)), frames, hidden, light, imaging)
    for frame in shown:
        if follower is None:
            T = moved_pose(frame.T_camera_target, offset)
            follower = ObjectFollower(tracker, CAMERA, T, 0.0, 1.0 / RATE_HZ, OUTLINE_RULE)
        step = follower.follow(frame.image, frame.time)
        error = pose_difference(step.T_camera_target, frame.T_camera_target)
        turn = _shown_turn(tracker, step, frame.T_camera_target)
        images.append(
            Followed(
                name,
                condition,
                step.sighting is Sighting.SEEN,
                step.reason,
                1e3 * float(np.linalg.norm(error[:3])),
                float(np.rad2deg(turn)),
                deviations_of(error, step.covariance[:6, :6]),
                frame.hidden,
            )
        )
    return images


def _shown_turn(tracker: SilhouetteTracker, step: Step, T_true: FloatArray) -> float:
    """Return the angle of the error of the turns that show, rad."""
    axes = tracker.axes.axes
    R, R_true = step.T_camera_target[:3, :3], T_true[:3, :3]
    if len(axes) == 1:  # exactly, however far it has turned about its axis
        aside = np.linalg.norm(np.cross(R @ axes[0], R_true @ axes[0]))
        return float(np.arctan2(aside, (R @ axes[0]) @ (R_true @ axes[0])))
    turn = pose_difference(step.T_camera_target, T_true)[3:]
    unseen = step.unseen[3:]
    return float(np.linalg.norm(turn - unseen @ (unseen.T @ turn)))


def checks_of(images: Sequence[Followed]) -> tuple[Check, ...]:
    """Return the checks of all images, and the error of each condition and of each object."""
    seen = [image for image in images if image.seen]
    hidden = max(image.hidden for image in images)
    note = f"{len(images)} images, up to {hidden:.0%} of an object hidden"
    wrong = 1e3 * float(np.mean([not i.deviations <= _WRONG for i in seen])) if seen else np.nan
    share = len(seen) / len(images)
    checks = [
        _error("region.error_mm", images),
        Check(
            "region.error_deg", f"95 of 100 images within {_MOST_DEG:g}°",
            _percentile([image.error_deg for image in seen]), "°",
            within(_percentile([image.error_deg for image in seen]), high=_MOST_DEG),
            "of the turns that show",
        ),
        Check(
            "region.seen_share", f"seen in at least {_LEAST_SEEN:g} of the images", share, "",
            within(share, _LEAST_SEEN), note,
        ),
        Check(
            "region.wrong_per_1000", "poses beyond 5 σ: at most 1 of 1000", wrong, "",
            within(wrong, high=_MOST_WRONG),
        ),
        Check(
            "region.reasons", "each image without it says why", float(len(images) - len(seen)),
            "images", all(image.reason for image in images if not image.seen),
        ),
    ]  # fmt: skip
    for condition in CONDITIONS:
        own = [image for image in images if image.condition == condition]
        checks.append(_error(f"region.{condition}.error_mm", own))
    objects = dict.fromkeys(image.object for image in images)
    checks += [
        _error(f"region.{name}.error_mm", [i for i in images if i.object == name])
        for name in objects
    ]
    return tuple(checks)


def _error(name: str, images: Sequence[Followed]) -> Check:
    errors = [image.error_mm for image in images if image.seen]
    wrong = sum(image.seen and not image.deviations <= _WRONG for image in images)
    median = f"median {np.median(errors):.2g} mm" if errors else "never seen"
    return Check(
        name,
        f"95 of 100 images within {_MOST_MM:g} mm, at 0.45 m",
        _percentile(errors),
        "mm",
        within(_percentile(errors), high=_MOST_MM),
        f"{median}; seen in {len(errors)} of {len(images)} images, {wrong} of them wrong",
    )


def _percentile(values: Sequence[float]) -> float:
    return float(np.percentile(values, 95)) if values else float("nan")


_CAPTION = (
    "Error of the position at about 0.45 m, of the images in which the object is seen: the median "
    "of a film as a dot, and the line ends at the error that 95 of 100 images keep within."
)


def _errors(images: Sequence[Followed]) -> Any:
    names = list(dict.fromkeys(image.object for image in images))[::-1]
    drawing, (axes,) = figure(7.6, 0.42 * len(names) + 1.2)
    for n, condition in enumerate(CONDITIONS):
        for row, name in enumerate(names):
            own = [
                i.error_mm
                for i in images
                if (i.object, i.condition) == (name, condition) and i.seen
            ]
            if not own:
                continue
            height = row + 0.25 * (1 - n)
            label = condition if row == len(names) - 1 else None
            axes.plot(
                [np.median(own), _percentile(own)], [height] * 2, color=COLORS[n], marker="o",
                markevery=[0], markersize=4, label=label,
            )  # fmt: skip
    axes.set_yticks(range(len(names)), names)
    logarithmic(axes, "x")
    axes.set_xlabel("error of the position (mm)")
    axes.grid(visible=False, axis="y")
    legend(axes)
    return drawing
