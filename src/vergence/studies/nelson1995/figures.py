"""Figures 4, 5 and 8 to 15 of [Nelson1995], drawn from our runs."""

from pathlib import Path
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell import Cell
from vergence.control import OptimalTracking
from vergence.drawing import COLORS, curve, figure, legend
from vergence.robot import Arm, joint_limit_penalty, manipulability
from vergence.simulation import SimulatedDriver
from vergence.studies.check import Figure
from vergence.studies.figure_files import save_figures
from vergence.studies.nelson1995.trial import Trial, Trials

_WIDTH, _HEIGHT = 7.6, 3.0  # inches
_LABELS = {
    "two_axis": "two axes",
    "four_axis": "four axes, no avoidance",
    "avoidance": "four axes with avoidance",
}


def draw(out: Path, cell: Cell, trials: Trials) -> tuple[Figure, ...]:
    """Write every figure into a folder; return them in the paper's order."""
    driver = SimulatedDriver(cell, images=False)
    arm = driver.world.arm_to_camera(cell.task.camera)
    start = driver.read().joints[cell.task.arm].position
    objective = cell.law.objective
    assert isinstance(objective, OptimalTracking)
    two = [trials["two_axis", sign] for sign in (-1, 1)]
    avoiding = [trials["avoidance", sign] for sign in (-1, 1)]
    drawn = {
        "figure_04": (
            _measures(arm, start, objective.penalty_k),
            "Figure 4: Yoshikawa's measure squared and the modified measure w' as joint 5 moves.",
        ),
        "figure_05": (_penalties(arm, start), "Figure 5: the penalty P for various k."),
        "figure_08": (_translation(trials, 1), "Figure 8: motion along +x."),
        "figure_09": (_translation(trials, -1), "Figure 9: motion along −x."),
        "figure_10": (
            _manipulability(two, "camera_m", "camera translation x (m)"),
            "Figure 10: manipulability, two axes.",
        ),
        "figure_11": (
            _penalty(two, "camera_m", "camera translation x (m)"),
            "Figure 11: penalty, two axes.",
        ),
        "figure_12": (
            _manipulability(avoiding, "estimated_m", "estimated object translation x (m)"),
            "Figure 12: manipulability, four axes with avoidance.",
        ),
        "figure_13": (
            _penalty(avoiding, "estimated_m", "estimated object translation x (m)"),
            "Figure 13: penalty, four axes with avoidance.",
        ),
        "figure_14": (
            _depth(avoiding),
            "Figure 14: depth of the object, four axes with avoidance.",
        ),
        "figure_15": (
            _errors(trials),
            "Figure 15: feature error, motion along −x, two and four axes.",
        ),
    }
    return save_figures(out, drawn)


def _axes(x_label: str, y_label: str) -> tuple[Any, Any]:
    drawing, (axes,) = figure(_WIDTH, _HEIGHT)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    return drawing, axes


def _sweep(arm: Arm, start: FloatArray, joint: int) -> FloatArray:
    """Return joint positions (K, n) with one joint going from limit to limit."""
    q = np.tile(start, (401, 1))
    q[:, joint] = np.linspace(arm.q_min[joint], arm.q_max[joint], len(q))
    return q


def _measures(arm: Arm, start: FloatArray, k: float) -> Any:
    q = _sweep(arm, start, 4)
    measures = [manipulability(arm.chain, row, arm.q_min, arm.q_max, k, False, 0.0) for row in q]
    drawing, axes = _axes("joint 5 (degrees)", "manipulability (m⁶)")
    degrees = np.rad2deg(q[:, 4])
    axes.plot(degrees, [m.det_JJt for m in measures], label="det(J Jᵀ)", **curve(1))
    axes.plot(degrees, [m.value for m in measures], label="w' (26)", **curve(0))
    legend(axes)
    return drawing


def _penalties(arm: Arm, start: FloatArray) -> Any:
    q = _sweep(arm, start, 4)
    drawing, axes = _axes("joint 5 (degrees)", "penalty P")
    for index, k in enumerate((1e4, 3e4, 1e5, 3e5)):
        P = [joint_limit_penalty(row, arm.q_min, arm.q_max, k)[0] for row in q]
        axes.plot(np.rad2deg(q[:, 4]), P, label=f"k = {k:.0e}", **curve(index))
    legend(axes)
    return drawing


def _translation(trials: Trials, sign: int) -> Any:
    drawing, axes = _axes("time (s)", "translation (m)")
    whole = trials["avoidance", sign]
    axes.plot(whole.camera.time, whole.object_m, color="#999", linewidth=3, label="object")
    for index, (strategy, label) in enumerate(_LABELS.items()):
        trial = trials[strategy, sign]
        time = trial.camera.time
        axes.plot(time, trial.camera_m, label=f"camera, {label}", **curve(index))
        if strategy == "avoidance":
            axes.plot(
                time,
                trial.estimated_m,
                label="object as estimated (32)",
                color=COLORS[index],
                linestyle="--",
            )
        if not trial.outcome.succeeded:
            axes.plot(time[-1], trial.camera_m[-1], "x", color=COLORS[index], markersize=8)
            axes.annotate(
                trial.outcome.kind.value,
                (time[-1], trial.camera_m[-1]),
                xytext=(6 if index else -6, 9 * sign),  # where no curve runs
                textcoords="offset points",
                ha="left" if index else "right",
                va="center",
                fontsize=8,
            )
    legend(axes)
    return drawing


def _manipulability(trials: list[Trial], x: str, x_label: str) -> Any:
    drawing, axes = _axes(x_label, "manipulability (m⁶)")
    for trial in trials:
        first = trial is trials[0]
        w, P = trial.arm.manipulability, trial.arm.penalty
        along = getattr(trial, x)
        axes.plot(along, w, label="w' (26)" if first else None, **curve(0))
        axes.plot(
            along,
            np.divide(w, P, out=np.full_like(w, np.nan), where=P > 1e-9),
            label="without the penalty" if first else None,
            color=COLORS[1],
            linestyle="--",
        )
    axes.set_ylim(bottom=0.0)
    legend(axes)
    return drawing


def _penalty(trials: list[Trial], x: str, x_label: str) -> Any:
    drawing, axes = _axes(x_label, "penalty P")
    for trial in trials:
        axes.plot(getattr(trial, x), trial.arm.penalty, **curve(0))
    axes.set_ylim(bottom=0.0)
    return drawing


def _depth(trials: list[Trial]) -> Any:
    drawing, axes = _axes("estimated object translation x (m)", "depth of the feature (m)")
    for trial in trials:
        axes.plot(trial.estimated_m, trial.camera.true_depth_m[:, 0], **curve(0))
    axes.set_ylim(bottom=0.0)
    return drawing


def _errors(trials: Trials) -> Any:
    drawing, axes = _axes("time (s)", "feature error (px)")
    for index, strategy in ((0, "two_axis"), (2, "avoidance")):
        trial = trials[strategy, -1]
        label = _LABELS[strategy]
        axes.plot(trial.camera.time, trial.error_px, label=label, **curve(index))
    axes.set_ylim(bottom=0.0)
    legend(axes)
    return drawing
