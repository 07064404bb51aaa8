"""The runs of the study of imaging: a law or a tracker in a cell, and how each is measured."""

from typing import Literal, NamedTuple

import numpy as np

from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.experiments import law_table
from vergence.experiments.evaluation import TrueTracks
from vergence.runtime import Run
from vergence.studies.region.objects import OBJECTS
from vergence.studies.region.study import follow_film
from vergence.studies.rendered import with_imaging

IMAGINGS = ("ideal", "real_camera")
_LAST_S = 0.5  # over which a final error is averaged
_FILM = 40  # images of an object that is followed by its outline
_OBJECTS = ("can", "mug", "ball", "bottle")


class Measured(NamedTuple):
    """How a run went."""

    lost: bool  # ended before its time
    final: float  # error of the farthest feature, true, mean of the last second
    tracking: float  # root mean square difference of what was found from the truth


class Trial(NamedTuple):
    """What is run."""

    cell: str  # or "" for the films of objects
    duration_s: float = 3.0
    law: str = "own"
    by_pose: bool = False  # whether the pose of the target is estimated


class Case(NamedTuple):
    """A law or a tracker, and where it is tried."""

    role: Literal["law", "tracker"]
    name: str
    trial: Trial

    @property
    def unit(self) -> str:
        """Of the final error."""
        return "px" if self.trial.cell else "mm"

    @property
    def tracking_unit(self) -> str:
        """Of the tracking error."""
        return "mm" if self.trial.by_pose or not self.trial.cell else "px"


_LAWS = (
    "image_based",
    "image_based_mean",
    "optimal_tracking",
    "constrained",
    "constrained_tracking",
)
CASES = (
    *(Case("law", name, Trial("ur5", law=name)) for name in _LAWS),
    Case("law", "position_based", Trial("eye_to_hand_pose", by_pose=True)),
    Case("tracker", "points", Trial("panda")),
    Case("tracker", "tags", Trial("tag", duration_s=4.0)),
    Case("tracker", "round_marks", Trial("gantry", duration_s=30.0)),
    Case("tracker", "ellipse", Trial("ellipse")),
    Case("tracker", "lines", Trial("line")),
    Case("tracker", "region", Trial("leaf", duration_s=4.0)),
    Case("tracker", "edges", Trial("eye_to_hand_pose", by_pose=True)),
    Case("tracker", "outline", Trial("")),
)


def measure(trial: Trial, imaging: str, seed: int) -> Measured:
    """Run a trial with one kind of images."""
    if not trial.cell:
        return _outline(imaging, seed)
    cell = load_cell(trial.cell, seed=seed)
    cell = cell.replace(duration_s=trial.duration_s, law=law_table(cell, trial.law))
    return _measured(run_cell(with_imaging(cell, imaging)), trial.by_pose)


def _measured(run: Run, by_pose: bool) -> Measured:
    camera = run.info.task_camera
    tracks = TrueTracks.of(run, camera)
    errors = tracks.errors()
    last = errors[tracks.times >= tracks.times[-1] - _LAST_S]
    if by_pose:
        off = 1e3 * np.linalg.norm(run.pose_errors.target_m, axis=1)
    else:
        off = run.cameras[camera].drift_px
    off = off[np.isfinite(off)]
    lost = not run.outcome.succeeded
    return Measured(lost, float(np.nanmean(last)), float(np.sqrt(np.mean(off**2))))


def _outline(imaging: str, seed: int) -> Measured:
    """Follow an object through a film; errors of its position, mm, at about 0.45 m."""
    name = _OBJECTS[seed % len(_OBJECTS)]
    kind = list(OBJECTS).index(name)
    images = follow_film(name, "light", _FILM, np.random.default_rng([seed, kind]), imaging)
    errors = np.array([image.error_mm for image in images if image.seen])
    last = errors[-int(_LAST_S * 30) :]
    return Measured(not images[-1].seen, float(last.mean()), float(np.sqrt(np.mean(errors**2))))
