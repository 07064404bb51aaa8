"""Figures 3 to 5 of [Mezouar2001] from our paths and runs, and what the paper has no figure of."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.drawing import COLORS, curve, legend
from vergence.planning import Path as PlannedPath
from vergence.studies.check import Figure
from vergence.studies.ending_bars import ending_bars
from vergence.studies.figure_files import save_figures
from vergence.studies.ideal_loop import Motion
from vergence.studies.mezouar2001.methods import LABELS, METHODS
from vergence.studies.mezouar2001.path_panels import (
    camera_paths,
    draw_image,
    grid,
    image_paths,
    joint_paths,
    space,
)
from vergence.studies.mezouar2001.run import Realised, Section6
from vergence.studies.mezouar2001.trials import Trial, endings
from vergence.studies.reach_scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH = 8.6  # inches
_PATHS = {
    "straight": "no potentials",
    "visibility_only": "visibility only",
    "both": "both potentials",
    "optimised": "ours",
}


def draw(
    out: Path,
    section: Section6,
    classical: Mapping[str, Motion],
    starts: Mapping[str, Sequence[Trial]],
) -> tuple[Figure, ...]:
    """Write every figure into a folder; return them in the paper's order."""
    drawn = {
        "figure_03": (
            _figure_3(section),
            "Figure 3: initial and desired image; paths without potentials in the image and "
            "in the joints' ranges (limits at -1 and 1). Each mark's path runs from a circle to a "
            "square.",
        ),
        "figure_04": (
            _figure_4(section),
            "Figure 4: paths with the visibility potential alone.",
        ),
        "figure_05": (
            _planned_and_realised(section, "both"),
            "Figure 5: both potentials, planned and realised; velocities commanded of the camera; "
            "distance of each mark from its desired place.",
        ),
        "figure_optimised": (
            _planned_and_realised(section, "optimised"),
            "The optimised path, planned and realised as in figure 5.",
        ),
        "figure_space": (
            _in_space(section),
            "The camera's path from start to goal; strokes show its viewing direction.",
        ),
        "figure_classical": (
            _classical(section.scene, classical),
            "Servoing from the same start without a plan, up to where it fails; from circles to "
            "squares.",
        ),
        "figure_success": (
            _success(starts),
            "How servoing ends from random starts that are not proved infeasible.",
        ),
    }
    return save_figures(out, drawn)


def _figure_3(section: Section6) -> Any:
    scene, path = section.scene, section.paths["straight"]
    drawing, axes = grid(_WIDTH, 6.2, 2, 2)
    first = scene.seen_px(scene.arm.forward_kinematics(scene.q_start))
    for place, name, px, image in (
        (axes[0, 0], "(a) initial image", first, section.end_images[0]),
        (axes[0, 1], "(b) desired image", scene.goal_px, section.end_images[1]),
    ):
        draw_image(place, scene.camera, px, image)
        place.set_title(name, fontsize=9)
    _planned(axes[1], path, "(c)", "(d)")
    return drawing


def _figure_4(section: Section6) -> Any:
    drawing, axes = grid(_WIDTH, 3.1, 1, 2)
    _planned(axes[0], section.paths["visibility_only"], "(a)", "(b)")
    return drawing


def _planned_and_realised(section: Section6, name: str) -> Any:
    path, run, scene = section.paths[name], section.runs[name], section.scene
    drawing, axes = grid(_WIDTH, 8.8, 3, 2)
    _planned(axes[0], path, "(a)", "(b)")
    image_paths(axes[1, 0], scene.camera, run.camera.true_px)
    axes[1, 0].set_title("(c) realised, in the image", fontsize=9)
    joint_paths(axes[1, 1], run.motion.time, run.joints_normalized, scene.arm.names)
    axes[1, 1].set_title("(d) realised, joints", fontsize=9)
    axes[1, 1].set_xlabel("time (s)")
    legend(axes[1, 1])
    _velocities(axes[2, 0], run)
    axes[2, 0].set_title("(e) camera velocity", fontsize=9)
    for index, errors in enumerate(run.goal_error_px.T):
        axes[2, 1].plot(run.camera.time, errors, label=f"mark {index + 1}", **curve(index))
    axes[2, 1].set_title("(f) distance from the desired place", fontsize=9)
    axes[2, 1].set_xlabel("time (s)")
    axes[2, 1].set_ylabel("error (px)")
    axes[2, 1].set_ylim(bottom=0.0)
    axes[2, 1].set_xlim(left=0.0)
    legend(axes[2, 1])
    return drawing


def _velocities(axes: "Axes", run: Realised) -> None:
    time, v = run.motion.time, run.motion.v_camera
    for index, axis in enumerate("xyz"):
        axes.plot(time, 100.0 * v[:, index], label=f"v{axis} (cm/s)", color=COLORS[index])
    for index, axis in enumerate("xyz"):
        axes.plot(
            time,
            np.degrees(v[:, 3 + index]),
            label=f"ω{axis} (deg/s)",
            color=COLORS[index],
            linestyle="--",
        )
    axes.set_xlim(left=0.0)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("cm/s, degrees/s")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.35 * (high - low))  # room for the legend
    axes.legend(loc="upper center", ncols=2, fontsize=7.5, frameon=False)


def _planned(axes: Any, path: PlannedPath, left: str, right: str) -> None:
    arm = path.problem.arm
    image_paths(axes[0], path.problem.camera, path.points_px)
    axes[0].set_title(f"{left} planned, in the image", fontsize=9)
    joint_paths(axes[1], np.linspace(0.0, 1.0, len(path.q)), path.joints_normalized, arm.names)
    axes[1].set_title(f"{right} planned, joints", fontsize=9)
    axes[1].set_xlabel("part of the path")
    legend(axes[1])


def _in_space(section: Section6) -> Any:
    drawing, axes = space(_WIDTH, 5.4)
    named = [(_PATHS[name], path.T_world_camera) for name, path in section.paths.items()]
    camera_paths(axes, named, section.scene.points_world)
    axes.view_init(elev=22, azim=-60)
    axes.legend(loc="center left", bbox_to_anchor=(1.08, 0.5), frameon=False, fontsize=8.5)
    return drawing


def _classical(scene: Scene, motions: Mapping[str, Motion]) -> Any:
    titles = {
        "image_based": "image-based, current L",
        "image_based_mean": "image-based, mean L",
        "position_based": "position-based, straight camera path",
        "position_based_on_object": "position-based, object straight in the image",
    }
    drawing, axes = grid(7.2, 5.8, 2, 2)
    for place, (name, title) in zip(axes.flat, titles.items(), strict=True):
        motion = motions[name]
        image_paths(place, scene.camera, motion.points_px)
        place.set_title(f"{title}\n{motion.reason or 'arrives'}", fontsize=9)
    return drawing


def _success(starts: Mapping[str, Sequence[Trial]]) -> Any:
    drawing, axes = grid(_WIDTH, 3.2, 1, len(starts))
    titles = {"random": "random starts", "random_roll": "roll 120 to 180°"}
    for place, (name, trials) in zip(axes[0], starts.items(), strict=True):
        feasible = sum(not trial.infeasible for trial in trials)
        names = [LABELS[m] for m in METHODS] if place is axes[0, 0] else [""] * len(METHODS)
        ending_bars(place, names, [endings(trials, method) for method in METHODS])
        place.set_xlabel("of the feasible starts (%)")
        place.set_title(f"{titles[name]}: {feasible} of {len(trials)} feasible", fontsize=9)
    legend(axes[0, -1], *axes[0, :-1])
    return drawing
