"""Listens to a run beside a stationary target, and says what it tells of latency and mounting."""

from collections.abc import Mapping

import numpy as np

from vergence.assembly.law_context import LawContext
from vergence.estimation.self_calibration import SelfCalibration, SelfCalibrator
from vergence.runtime.run_info import RunInfo
from vergence.runtime.tick import TickRecord
from vergence.signals import Outcome

SELF_CALIBRATION = "self-calibration"  # the event that tells it


class SelfCalibrating:
    """Collects joints and image points of a run's task; nothing in the run is changed.

    Args:
        context: of the run.
    """

    def __init__(self, context: LawContext) -> None:
        self._name, self._arm = context.camera_name, context.cell.task.arm
        arm, camera = context.arm_to_camera(self._name), context.camera()
        self._calibrator = SelfCalibrator(arm, camera)
        self._depth_m = float(np.median(context.depth_m(self._name, None)))

    @staticmethod
    def suits(context: LawContext) -> bool:
        """Return whether a run can tell anything: points, a camera on the arm, a target at rest."""
        carried = context.cell.cameras[context.camera_name].arm == context.cell.task.arm
        if not (carried and context.declared_stationary) or context.curve is not None:
            return False
        return context.camera_name in context.points_px

    def begin(self, info: RunInfo) -> None:
        """Do nothing: the context says all."""

    def tick(self, record: TickRecord) -> None:
        """Take note of joints and points."""
        state = record.sample.joints[self._arm]
        self._calibrator.joints(state.time, state.position)
        for view in () if record.observation is None else record.observation.views:
            if view.camera == self._name:
                self._calibrator.image(view.time, view.points_px, view.found)

    def event(self, time: float, name: str, text: str) -> None:
        """Do nothing."""

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Do nothing: whoever wants to know asks for the estimate."""

    def estimate(self) -> SelfCalibration:
        """Return what the run tells so far."""
        return self._calibrator.estimate(self._depth_m)


def words(found: SelfCalibration) -> str:
    """Return in words what a run told, and what its motion was not enough for."""
    if found.reason:
        return f"the run does not determine the camera's parameters: {found.reason}"
    s, told = found.deviations, found.told
    rotation, place = np.rad2deg(found.rotation_rad), 1e3 * found.distance_m
    parts = (
        (told[0], f"stamps {1e3 * found.latency_s:.1f} ± {1e3 * s[0]:.1f} ms late"),
        (
            told[1:4].all(),
            f"camera turned by {rotation:.2f} ± {np.rad2deg(s[1:4].max()):.2f}° from its place",
        ),
        (told[4:7].all(), f"{place:.1f} ± {1e3 * s[4:7].max():.1f} mm away from it"),
        (told[7], f"focal length times {found.focal:.4f} ± {s[7]:.4f}"),
    )
    known = [text for there, text in parts if there]
    names = ("latency", "rotation", "position", "focal length")
    open_ = [name for (there, _), name in zip(parts, names, strict=True) if not there]
    text = ", ".join(known)
    if open_:
        text += f"{'; ' if known else ''}too little motion for {', '.join(open_)}"
    return text
