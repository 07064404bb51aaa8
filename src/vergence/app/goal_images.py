"""A photograph beside the images of the run that went there: matches, start, end, both blended."""

from pathlib import Path
from typing import Any

import numpy as np

from vergence.app import markup
from vergence.arrays import ImageArray
from vergence.camera import Camera
from vergence.camera.grey_levels import grey_levels, grey_values
from vergence.camera.image_file import as_jpeg, read_image_file
from vergence.camera.photograph import read_photograph
from vergence.cell import Cell
from vergence.cell.schema import ReachTable
from vergence.runtime.recording import Recording

GOAL = "goal.png"  # in the run's folder; goal-2.png for the second of several tasks
_BEFORE_S = 0.5  # by which the first image of a task may be older
_LINES = 40  # matches drawn
_QUALITY = 88  # JPEG
_WIDTH_PX = 640  # of one image


def keep_goal(cell: Cell, folder: Path, camera: Camera) -> None:
    """Put the photograph, as the arm's camera would have taken it, into a run's folder."""
    import cv2

    for number, task in enumerate(cell.tasks or (cell.task,)):
        if isinstance(task, ReachTable) and task.goal is not None:
            photograph = read_photograph(cell.path.parent / task.goal, camera)
            name = _goal_file(number) if cell.tasks else GOAL
            cv2.imwrite(str(folder / name), photograph.image)


def goal_section(recording: Recording) -> str:
    """Return the sections of a report that show the photographs; empty without any."""
    tasks = recording.outcome.tasks
    if not tasks:
        return _section(recording, "Goal", GOAL, 0.0, float("inf"))
    return "".join(
        _section(recording, f"Goal of {t.name}", _goal_file(number), t.begun, t.outcome.time)
        for number, t in enumerate(tasks)
    )


def _goal_file(number: int) -> str:
    return f"goal-{number + 1}.png"


def _section(recording: Recording, title: str, file_name: str, begun: float, ended: float) -> str:
    """Return the section of one photograph, with the first and last image of its task."""
    file, name = recording.folder / file_name, recording.info.task_camera
    times = recording.image_times(name) if file.is_file() else np.empty(0)
    during = np.flatnonzero((times >= begun - _BEFORE_S) & (times <= ended))
    if not len(during):
        return ""
    raw = read_image_file(file)
    goal = grey_levels(grey_values(raw, str(file)), 255.0)
    images = [image for _, image in recording.images(name, only=(during[0], during[-1]))]
    if not images or any(image.shape != goal.shape for image in images):
        return ""
    camera, first, last = recording.info.cameras[name], images[0], images[-1]
    found, caption = _matches(first, goal, camera)
    blended = _jpeg(np.hstack([_coloured(goal), _coloured(last), _blended(last, goal)]))
    return markup.section(
        title,
        markup.image(found, "image/jpeg", caption),
        markup.image(
            blended,
            "image/jpeg",
            "The photograph, the last image, and both blended: grey where they agree, orange where "
            "the photograph is brighter, blue where the image is.",
        ),
    )


def _matches(image: ImageArray, goal: ImageArray, camera: Camera) -> tuple[bytes, str]:
    """Return first image and photograph side by side, what was recognised joined by lines."""
    import cv2

    from vergence.vision.matching import Compared, Sift, compare_images

    drawn = np.ascontiguousarray(np.hstack([_coloured(image), _coloured(goal)]))
    found = compare_images(image, goal, camera, Sift())
    if not isinstance(found, Compared):
        return _jpeg(drawn), f"The first image and the photograph. {found.reason}."
    here, there = found.matches.points_px, found.matches.points_star_px
    chosen = np.linspace(0, len(here) - 1, min(_LINES, len(here))).astype(int)
    colors = cv2.applyColorMap(
        np.linspace(0, 255, len(chosen)).astype(np.uint8)[:, None], cv2.COLORMAP_TURBO
    )
    for (x, y), (x_star, y_star), color in zip(
        here[chosen], there[chosen], colors[:, 0].tolist(), strict=True
    ):
        ends = (round(x), round(y)), (round(x_star) + image.shape[1], round(y_star))
        cv2.line(drawn, *ends, color, 1, cv2.LINE_AA)
        for end in ends:
            cv2.circle(drawn, end, 4, color, 1, cv2.LINE_AA)
    caption = (
        f"The first image and the photograph: {len(here)} of {found.tried} matches agree on one "
        f"motion; {len(chosen)} are drawn."
    )
    return _jpeg(drawn), caption


def _coloured(image: ImageArray) -> ImageArray:
    return np.repeat(image[:, :, None], 3, axis=2)


def _blended(image: ImageArray, goal: ImageArray) -> ImageArray:
    """Return an image in blue over the photograph in orange (BGR)."""
    mixed: Any = (image[:, :, None] * np.array([1.0, 0.5, 0.0])) + (
        goal[:, :, None] * np.array([0.0, 0.5, 1.0])
    )
    return np.asarray(np.rint(mixed), dtype=np.uint8)


def _jpeg(drawn: ImageArray) -> bytes:
    import cv2

    height, width = drawn.shape[:2]
    scale = min(1.0, 2 * _WIDTH_PX / width)
    size = (round(scale * width), round(scale * height))
    small = cv2.resize(drawn, size, interpolation=cv2.INTER_AREA)
    return as_jpeg(np.asarray(small, np.uint8), _QUALITY)
