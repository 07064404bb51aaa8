"""Events of features and targets that are lost or found again, each reported once."""

import numpy as np

from vergence.runtime import endings
from vergence.runtime.listeners import Listeners
from vergence.signals import ImagePoints, Observation


def shows_target(observation: Observation) -> bool:
    """Return whether an observation has a target state, or any feature."""
    return bool(observation.target) or any(view.found.any() for view in observation.views)


def may_move(observation: Observation) -> bool:
    """Return whether an observation contains everything that the law needs."""
    return shows_target(observation) or not observation.needs_target


def reasons(observation: Observation) -> list[str]:
    """Return the reasons why features were not found, over all views."""
    return [reason for view in observation.views for reason in view.reasons]


class LossReports:
    """Notifies listeners when the target or a feature is lost or found again.

    Args:
        listeners: to notify.
    """

    def __init__(self, listeners: Listeners) -> None:
        self._listeners = listeners
        self._lost: dict[str, set[int]] = {}  # features, by camera
        self._target_lost = False

    def report(self, time: float, observation: Observation) -> None:
        """Report changes since the last observation; nothing if no target is needed."""
        if not observation.needs_target:
            return
        lost = not shows_target(observation)
        if lost != self._target_lost:
            self._target_lost = lost
            text = endings.why_lost(reasons(observation)) if lost else "it is back"
            name = "target out of sight" if lost else "target in sight"
            self._listeners.event(time, name, text)
        if observation.target is None and not lost:
            for view in {view.camera: view for view in observation.views}.values():
                self._report_features(time, view)

    def _report_features(self, time: float, view: ImagePoints) -> None:
        before = self._lost.get(view.camera, set())
        lost = set(np.flatnonzero(~view.found).tolist())
        for feature in sorted(lost - before):
            text = f"feature {feature} in {view.camera}: {view.reasons[feature]}"
            self._listeners.event(time, "feature lost", text)
        for feature in sorted(before - lost):
            text = f"feature {feature} in {view.camera} is back"
            self._listeners.event(time, "feature found", text)
        self._lost[view.camera] = lost
