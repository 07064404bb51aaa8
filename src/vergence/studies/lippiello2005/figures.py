"""Figures 5 to 8 of [Lippiello2005], drawn from our runs."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.drawing import curve, figure, legend
from vergence.geometry import matrix_to_rpy
from vergence.studies.check import Figure
from vergence.studies.figure_files import save_figures
from vergence.studies.lippiello2005.trials import Trial

_WIDTH, _HEIGHT = 7.6, 4.6  # inches


def draw(out: Path, trials: Mapping[str, Trial]) -> tuple[Figure, ...]:
    """Write every figure into a folder; return them in the paper's order."""
    hybrid, fixed, ours = trials["hybrid"], trials["fixed"], trials["ours"]
    drawn = {
        "figure_05": (
            _trajectory(hybrid),
            "Figure 5: the object's trajectory in its first frame, slow then twice as fast.",
        ),
        "figure_06": (
            _target_errors(hybrid),
            "Figure 6: error of the estimated pose, both cameras, the paper's settings.",
        ),
        "figure_07": (
            _pose_errors(hybrid),
            "Figure 7: error of the slave's end effector relative to the estimated object, both "
            "cameras, the paper's settings.",
        ),
        "figure_07_ours": (
            _pose_errors(ours),
            "The same with the error-state filter, feed-forward and prediction over the latency.",
        ),
        "figure_08": (
            _target_errors(fixed),
            "Figure 8: error of the estimated pose, the fixed camera alone, the paper's settings.",
        ),
    }
    return save_figures(out, drawn)


def _trajectory(trial: Trial) -> Any:
    poses = trial.errors.T_world_target
    relative = np.linalg.inv(poses[0]) @ poses
    rpy = np.array([matrix_to_rpy(np.ascontiguousarray(T[:3, :3])) for T in relative])
    drawing, (above, below) = figure(_WIDTH, _HEIGHT, rows=2, sharex=True)
    time = trial.errors.time
    _three(above, time, relative[:, :3, 3], ("x", "y", "z"), "position (m)")
    _three(below, time, np.rad2deg(rpy[:, ::-1]), ("roll", "pitch", "yaw"), "angle (degrees)")
    below.set_xlabel("time (s)")
    return drawing


def _target_errors(trial: Trial) -> Any:
    errors = trial.errors.between(trial.moving_from / 2)
    return _errors(errors.time, errors.target_m, errors.target_rad)


def _pose_errors(trial: Trial) -> Any:
    errors = trial.hand.between(trial.moving_from / 2)
    return _errors(errors.time, errors.metres, errors.radians)


def _errors(time: FloatArray, metres: FloatArray, radians: FloatArray) -> Any:
    drawing, (above, below) = figure(_WIDTH, _HEIGHT, rows=2, sharex=True)
    _three(above, time, 1e3 * metres, ("x", "y", "z"), "position error (mm)")
    below.plot(time, np.rad2deg(radians), **curve(0))
    below.set_ylabel("orientation error (degrees)")
    below.set_xlabel("time (s)")
    return drawing


def _three(
    axes: Any, time: FloatArray, values: FloatArray, names: tuple[str, ...], label: str
) -> None:
    for k, name in enumerate(names):
        axes.plot(time, values[:, k], label=name, **curve(k))
    axes.set_ylabel(label)
    legend(axes)
