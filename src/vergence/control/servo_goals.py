"""What a servo's features say of the goal: their errors, and where they would have the points."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from vergence.arrays import FloatArray
from vergence.control.nearest_points import feature_errors, nearest_points
from vergence.control.objectives import CameraState, ImageBased, Objective
from vergence.control.servo_camera import ServoCamera
from vergence.control.term import Term
from vergence.features import Feature, Points
from vergence.signals import JointCommand, Reference


class _Goal(NamedTuple):
    errors: dict[str, float]  # see `feature_errors`
    points_px: FloatArray | None  # (M, 2) nearest where these are 0; None if that is as desired


class ServoGoals:
    """Adds to commands what the features of each camera say of the goal.

    Args:
        terms: the objectives of the servo.
        cameras: of the servo, the main one first.

    Attributes:
        free: the cameras whose features alone say where they should come to.
    """

    def __init__(self, terms: Sequence[Term], cameras: Mapping[str, ServoCamera]) -> None:
        self._cameras, self._first = cameras, next(iter(cameras))
        features = {name: _features(terms, name) for name in cameras}
        self._features = {name: known for name, known in features.items() if known}
        self.free = {name for name in self._features if _only_features(terms, name)}

    def added(
        self, command: JointCommand, states: Mapping[str, CameraState], reference: Reference
    ) -> JointCommand:
        """Return the command with errors, and with the reference of `JointCommand`.

        Args:
            command: of the servo.
            states: of the cameras it used, by name.
            reference: as given.
        """
        errors: dict[str, float] = {}
        aimed = reference
        for name in [name for name in self._features if name in states]:
            main = name == self._first
            goal = self._goal(
                name, states[name], reference.points_px if main else reference.elsewhere_px[name]
            )
            errors |= {key if main else f"{name}: {key}": e for key, e in goal.errors.items()}
            if goal.points_px is None:
                continue
            if main:
                aimed = replace(aimed, points_px=goal.points_px)
            else:
                aimed = replace(aimed, elsewhere_px={**aimed.elsewhere_px, name: goal.points_px})
        if not errors:
            return command
        return replace(command, errors=errors, reference=None if aimed is reference else aimed)

    def _goal(self, name: str, state: CameraState, desired_px: FloatArray | None) -> _Goal:
        """Return what a camera's features say of the points in its last image."""
        view, camera = self._cameras[name].view, self._cameras[name].mounting.camera
        found, features = view.found, self._features[name]
        if desired_px is None or not found.any():
            return _Goal({}, None)
        now = Points(camera.normalize(view.points_px[found]), state.depth_m)
        desired = Points(camera.normalize(desired_px[found]), state.desired.depth_m)
        nearest = nearest_points(features, now, desired) if name in self.free else None
        points_px = None
        if nearest is not None:
            points_px = desired_px.copy()
            points_px[found] = camera.to_pixels(nearest)
        return _Goal(feature_errors(features, now, desired), points_px)


def _objectives(terms: Sequence[Term], camera: str) -> list[Objective]:
    """Return what a sum of objectives asks of one camera, less what only supplements it."""
    asked = [one for one, weight, name in terms if name == camera and weight > 0.0]
    return [one for one in asked if not getattr(one, "supplements", False)]


def _features(terms: Sequence[Term], camera: str) -> list[type[Feature]]:
    """Return the features of one camera, but not its points."""
    asked = [one.feature for one in _objectives(terms, camera) if isinstance(one, ImageBased)]
    return [feature for feature in asked if feature is not Points]


def _only_features(terms: Sequence[Term], camera: str) -> bool:
    """Whether these alone say where a camera should come to, and neither points nor a pose."""
    return len(_features(terms, camera)) == len(_objectives(terms, camera))
