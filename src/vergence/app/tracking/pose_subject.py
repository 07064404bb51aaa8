"""The pose of an object or a tag, as `vergence track` follows it."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vergence.app.tracking.drawing import draw_step
from vergence.app.tracking.results import PoseFiles, pose_record
from vergence.app.tracking.tag_follower import TagFollower
from vergence.app.tracking.track_subject import Result
from vergence.arrays import ImageArray
from vergence.camera import Camera
from vergence.estimation.known_object.hypothesis_follower import HypothesisFollower
from vergence.estimation.known_object.object_follower import Sighting, Step
from vergence.signals import Outcome, OutcomeKind

_NO_SAMPLES: dict[str, Any] = {
    "samples_px": np.zeros((0, 2)),
    "samples_found": np.zeros(0, dtype=np.bool_),
}
_TOLD_TURNS = 3
_APART = 1.2  # ratio of two deviations that are worth telling apart


class PoseSubject:
    """A `Subject` whose pose is followed.

    Args:
        follower: follows it.
        camera: the camera's model.
    """

    def __init__(self, follower: HypothesisFollower | TagFollower, camera: Camera) -> None:
        self._follower, self._camera = follower, camera
        self._steps: list[Step] = []

    @property
    def in_color(self) -> bool:
        """Whether images are to be in colour."""
        return self._follower.in_color

    @property
    def state(self) -> Sighting:
        """What became of it in the last image."""
        return self._step.sighting

    @property
    def given_up(self) -> bool:
        """Whether it is lost and was never seen."""
        return self._step.sighting is Sighting.LOST and not self._follower.was_seen

    @property
    def files(self) -> Mapping[str, Path]:
        """The files that are written."""
        return {"poses": self._files.table, "poses_with_covariance": self._files.lines}

    def writing(self, folder: Path) -> PoseFiles:
        """Return what opens and closes its files in a folder."""
        self._files = PoseFiles(folder)
        return self._files

    def follow(self, image: ImageArray, time: float) -> None:
        """Look at the next image."""
        self._step = self._follower.follow(image, time)
        self._steps.append(replace(self._step, **_NO_SAMPLES))  # a long film must fit in memory

    def write(self, image_name: str) -> None:
        """Write the pose in the last image."""
        self._files.add(image_name, self._step)

    def draw(self, image: ImageArray) -> NDArray[np.uint8]:
        """Return the last image with the object's edges or outline, and axes, drawn in."""
        return draw_step(image, self._step, self._follower.tracker, self._camera)

    def result(self, median_ms: float) -> Result:
        """Return how it went."""
        steps, follower = self._steps, self._follower
        seen = [step for step in steps if step.sighting is Sighting.SEEN]
        widest = np.max([step.deviation for step in seen], axis=0) if seen else np.full(2, np.nan)
        place_m, turn_deg = float(widest[0]), float(np.rad2deg(widest[1]))
        free, alike = follower.tracker.free, tuple(map(str, follower.symmetries))
        answer = {
            "frames": len(steps),
            "seen": len(seen),
            "position_deviation_max_m": place_m,
            "rotation_deviation_max_deg": turn_deg,
            "median_ms": median_ms,
            "unseen_turns": free or None,
            "symmetries": alike,
            "note": follower.note or None,
            "last": pose_record(steps[-1]),
        }
        spread = f"standard deviation up to {1e3 * place_m:.2g} mm, {turn_deg:.2g}°"
        told_deg = np.rad2deg(max((_told_turn(step) for step in seen), default=np.nan))
        if not free and told_deg > _APART * turn_deg:
            spread += f", and {told_deg:.2g}° where an image does not show every rotation"
        lines = [
            f"seen in {len(seen)} of {len(steps)} images · {spread + ' · ' if seen else ''}"
            f"{median_ms:.1f} ms per image"
        ]
        if free:
            lines.append(f"{free}; its standard deviation is that of an unknown angle, 104°")
        table, detail = self._files.table, self._files.lines.name
        lines.append(f"poses    {table}  (with covariances: {detail})")
        if alike:
            lines.append(f"symmetric: it looks the same turned by {_listed(alike)}")
        if follower.note:
            lines.append(follower.note)
        return Result(_outcome(steps), answer, tuple(lines))


def _told_turn(step: Step) -> float:
    """Return the largest standard deviation of the rotation that the files say, rad."""
    return float(np.sqrt(np.diag(step.covariance)[3:6].max()))


def _outcome(steps: list[Step]) -> Outcome:
    """Return how it ended: whatever the last image does not show is not held."""
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


def _listed(turns: tuple[str, ...]) -> str:
    """Return a few of the turns in words."""
    rest = len(turns) - _TOLD_TURNS
    return ", ".join(turns[:_TOLD_TURNS]) + (f" and {rest} others" if rest > 0 else "")
