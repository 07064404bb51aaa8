"""The pose of a tag in footage, without a start: its number is enough."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.assembly.tag import TagFinder
from vergence.camera import Camera
from vergence.cell.schema import TagTable
from vergence.errors import InputError
from vergence.estimation import (
    CameraRig,
    MirrorWatch,
    NoPose,
    PoseFilter,
    PosePerception,
    TargetShape,
    pose_from_points,
    view_of,
)
from vergence.estimation.known_object.object_follower import CAMERA, Sighting, Step
from vergence.signals import Frame, ImagePoints, TargetState
from vergence.vision.known_object import ObjectModel

_NOISE_PX = 0.5  # for the windows of the perception, which finds the tag anywhere
_UNKNOWN = np.diag(np.repeat([10.0, 2.0, 0.2, 0.5], 3) ** 2)  # before the first pose
_NO_TURNS = np.zeros((6, 0))


def tag_of_option(text: str) -> TagTable:
    """Return the tag that ``DICTIONARY:ID:SIZE`` means, such as ``apriltag_36h11:7:0.05``.

    Raises:
        InputError: if it is none.
    """
    parts = text.split(":")
    try:
        dictionary, number, size = parts[0], int(parts[1]), float(parts[2])
    except (IndexError, ValueError):
        allowed = "DICTIONARY:ID:SIZE, the side of its border in metres: apriltag_36h11:7:0.05"
        raise InputError("vergence track", "--tag", text, allowed) from None
    from pydantic import ValidationError

    from vergence.validation import explain

    values = {"dictionary": dictionary, "id": number, "size_m": size}
    try:
        return TagTable.model_validate(values)
    except ValidationError as error:
        known = list(values)
        raise explain(error, "track: --tag", values, lambda _: known) from None


class Shown(NamedTuple):
    """What is drawn into the images."""

    model: ObjectModel
    free: str = ""  # turns that no image shows: none


class TagFollower:
    """Follows a tag through the images of one camera; finds it again wherever it comes back.

    Args:
        tag: which.
        camera: the camera's model.
    """

    in_color = False
    was_seen = True  # it is searched for to the end
    symmetries = ()
    note = ""

    def __init__(self, tag: TagTable, camera: Camera) -> None:
        self.tracker = Shown(ObjectModel.from_face(f"tag {tag.id}", tag.corners))
        self._finder, self._points, self._camera = TagFinder(tag), np.array(tag.corners), camera
        self._perception: MirrorWatch | None = None
        self._instead = ""  # what the first image without it shows
        self._state = TargetState(0.0, np.eye(4), np.zeros(6), _UNKNOWN, True)

    def follow(self, image: ImageArray, time: float) -> Step:
        """Return the tag after one image."""
        frame = Frame(CAMERA, time, image, {})
        found = self._finder.find(frame)
        if self._perception is None:
            return self._first(frame, found)
        observation = self._perception.observe([frame])
        assert observation is not None
        if observation.target is None:
            return self._step(frame, found, Sighting.LOST, self._perception.lost)
        self._state = observation.target
        if found is None:
            return self._step(frame, None, Sighting.PREDICTED, str(self._finder.tag(frame)))
        if self._perception.doubtful:
            reason = "a second pose, tilted the other way, explains the images as well"
            return self._step(frame, found, Sighting.AMBIGUOUS, reason)
        return self._step(frame, found, Sighting.SEEN, "")

    def _first(self, frame: Frame, found: ImagePoints | None) -> Step:
        """Begin where an image leaves one pose only."""
        if found is None:
            if not self._instead:  # once: all dictionaries are tried
                self._instead = self._finder.seen_instead(frame)
            reason = f"{self._finder.tag(frame)}; the first image without it: {self._instead}"
            return self._step(frame, None, Sighting.LOST, reason)
        fit = pose_from_points([view_of(found, self._camera, np.eye(4), self._points)])
        if isinstance(fit, NoPose):
            others = tuple(one.T_world_target for one in fit.alternatives)
            kind = Sighting.AMBIGUOUS if others else Sighting.LOST
            return self._step(frame, found, kind, fit.reason, others)
        rig = CameraRig.of({CAMERA: self._camera}, _NOISE_PX)
        shape = TargetShape.from_mesh(self._points, self._points, self.tracker.model.triangles)
        covariance = _UNKNOWN.copy()
        covariance[:6, :6] = fit.covariance
        target_filter = PoseFilter()
        start = target_filter.start(fit.time, fit.T_world_target, covariance=covariance)
        perception = PosePerception(
            rig, shape, _still, self._finder, target_filter, start, find=self._finder.find
        )
        self._perception = MirrorWatch(perception, rig, _still, self._points)
        self._state = perception.state
        return self._step(frame, found, Sighting.SEEN, "")

    def _step(
        self,
        frame: Frame,
        found: ImagePoints | None,
        sighting: Sighting,
        reason: str,
        alternatives: tuple[FloatArray, ...] = (),
    ) -> Step:
        state = self._state
        deviations = np.sqrt(np.diag(state.covariance))
        corners = np.zeros((0, 2)) if found is None else found.points_px
        return Step(
            frame.time,
            sighting,
            reason,
            alternatives[0] if alternatives else state.T_world_target,
            state.velocity,
            state.covariance,
            (float(deviations[:3].max()), float(deviations[3:6].max())),
            _NO_TURNS,
            0.0 if found is None else 1.0,
            corners,
            np.ones(len(corners), dtype=np.bool_),
            alternatives,
        )


def _still(_camera: str, _joints: object) -> FloatArray:
    """Return the pose of the camera, which is the frame in which the tag is followed."""
    return np.eye(4)
