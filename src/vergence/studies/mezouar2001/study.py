"""[Mezouar2001] section 6: planned paths, tracked plans, and how often each method arrives."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from vergence.cell import load_cell
from vergence.experiments.workers import Workers
from vergence.planning import Path as PlannedPath
from vergence.studies.check import Check, Others, Progress, StudyResult, within
from vergence.studies.ideal_loop import Ending, IdealLoop, Motion
from vergence.studies.mezouar2001 import figures
from vergence.studies.mezouar2001.methods import (
    CLASSICAL,
    CLASSICAL_S,
    LABELS,
    METHODS,
    ROOM,
)
from vergence.studies.mezouar2001.misprint import Joined, join_paths
from vergence.studies.mezouar2001.run import Realised, plan_section6, run_section6
from vergence.studies.mezouar2001.trials import (
    NOISE_PX,
    ROLL_DEG,
    End,
    Trial,
    endings,
    random_starts,
    wrong_beliefs,
)
from vergence.studies.reach_scene import Scene
from vergence.studies.rendered import with_imaging

SECTION_NOISE_PX = 0.05  # of section 6 on the exact projections of a quick study
TITLE = "Mezouar and Chaumette (2001): trajectories in the image inside view and joint limits"
COUNTS = {"random": 200, "random_roll": 100, "perturbed": 100, "joined": 100}
COUNTS_QUICK = {"random": 40, "random_roll": 20, "perturbed": 20, "joined": 40}
AXIS_5 = 4


def reproduce(
    out: Path,
    quick: bool,
    progress: Progress = lambda _what, _share: None,
    seed: int = 0,
    imaging: str | None = None,
    *,
    counts: Mapping[str, int] | None = None,
    workers: int | None = None,
) -> StudyResult:
    """Run section 6 and what follows from it; write the figures.

    Args:
        out: folder for the figures.
        quick: exact projections instead of rendered images, fewer random starts.
        progress: called with the current step.
        seed: of the cell, the random starts and the wrong beliefs.
        imaging: of the camera, see `ImagingTable`.
        counts: random starts and wrong beliefs to try, instead of the usual numbers.
        workers: processes for those; see `Workers`.
    """
    cell = with_imaging(load_cell("gantry", seed=seed), imaging)
    if quick:
        cell = cell.replace(task={"noise_px": SECTION_NOISE_PX})
    counts = counts or (COUNTS_QUICK if quick else COUNTS)
    progress("planning", 0.0)
    section = plan_section6(cell, not quick)
    runs = {}
    for k, name in enumerate(("both", "optimised")):
        progress(f"tracking, {name}", 0.05 + 0.1 * k)
        runs[name] = run_section6(cell, section, name, not quick)
    section = replace(section, runs=runs)
    classical = servo_classically(section.scene)

    def share(what: str, start: float, end: float) -> Callable[[float], None]:
        progress(what, start)
        return lambda done: progress(what, start + done * (end - start))

    scene = section.scene
    with Workers(workers) as pool:
        beliefs = wrong_beliefs(
            scene, counts["perturbed"], pool, share("wrong beliefs", 0.25, 0.4), seed
        )
        starts = {
            "random": random_starts(
                scene, None, counts["random"], pool, share("random starts", 0.4, 0.7), seed
            ),
            "random_roll": random_starts(
                scene, ROLL_DEG, counts["random_roll"], pool, share("random rolls", 0.7, 0.95), seed
            ),
        }
        progress("joints of the paths", 0.95)
        joined = join_paths(scene, counts["joined"], pool, seed)
    checks = [
        *_broken_paths(section.paths),
        *_kept_paths(section.paths, runs),
        *_tracking(runs),
        *_classical(classical),
        _misprint(joined),
        _perturbed(beliefs),
        *(_random(name, trials) for name, trials in starts.items()),
    ]
    progress("figures", 0.97)
    drawn = figures.draw(out, section, classical, starts)
    return StudyResult(TITLE, tuple(checks), drawn, seed)


def servo_classically(scene: Scene) -> Mapping[str, Motion]:
    """Servo from the section's start without a plan, on exact projections."""
    loop = IdealLoop(scene.arm, scene.camera, scene.points_world, scene.goal_px)
    return {
        name: loop.run(scene.q_start, law(scene), CLASSICAL_S, np.random.default_rng(0))
        for name, law in CLASSICAL.items()
    }


def _broken_paths(paths: Mapping[str, PlannedPath]) -> list[Check]:
    straight, seen = paths["straight"], paths["visibility_only"]
    out_px, kept_px = -straight.image_margin_px, seen.image_margin_px
    axis5, axis5_seen = (_largest(path, AXIS_5) for path in (straight, seen))
    return [
        Check(
            "straight.leaves_view",
            "points get out largely of the field of view (Fig. 3c)",
            out_px,
            "px",
            within(out_px, 20.0),
            "how far outside; no potentials",
            "more than 20",
        ),
        Check(
            "straight.joint5_limit",
            "axis 5 attains its limit (Fig. 3d)",
            axis5,
            "of range",
            axis5 > 1.0,
            "largest normalised position",
            "beyond 1",
        ),
        Check(
            "visibility_only.in_view",
            "the visibility constraint is ensured (Fig. 4a)",
            kept_px,
            "px",
            kept_px > 0.0,
            "least distance to the border of the image",
            "above 0",
        ),
        Check(
            "visibility_only.joint5_limit",
            "axis 5 reaches its limit (Fig. 4b)",
            axis5_seen,
            "of range",
            axis5_seen > 1.0,
            bound="beyond 1",
        ),
    ]


def _kept_paths(paths: Mapping[str, PlannedPath], runs: Mapping[str, Realised]) -> list[Check]:
    checks = []
    for name, said in (("both", "Fig. 5a-d"), ("optimised", "not in the paper")):
        path, run = paths[name], runs[name]
        planned_px, planned_joint = path.image_margin_px, path.joint_margin
        px, joint = min(planned_px, run.image_margin_px), min(planned_joint, run.joint_margin)
        checks += [
            Check(
                f"{name}.in_view",
                f"the target remains in the field of view ({said})",
                px,
                "px",
                px > 0.0,
                f"least distance to the border: planned {planned_px:.1f}, "
                f"realised {run.image_margin_px:.1f}",
                "above 0",
            ),
            Check(
                f"{name}.joint_margin",
                f"all axes avoid their joint limits ({said})",
                joint,
                "of range",
                joint > 0.0,
                f"planned {planned_joint:.3f}, realised {run.joint_margin:.3f}; "
                f"{path.camera_length_m:.2f} m in {run.trajectory.duration:.1f} s",
                "above 0",
            ),
        ]
    return checks


def _tracking(runs: Mapping[str, Realised]) -> list[Check]:
    error = {name: float(run.tracking_error_px.max()) for name, run in runs.items()}
    final = {name: float(run.goal_error_px[-1].max()) for name, run in runs.items()}
    pose = {name: run.final_pose_error for name, run in runs.items()}
    completed = all(realised.run.outcome.succeeded for realised in runs.values())
    worst_pose = max(metres for metres, _ in pose.values())
    return [
        Check(
            "tracking.error_max_px",
            "planned and realised trajectories are almost similar",
            max(error.values()),
            "px",
            completed and within(max(error.values()), 0.0, 5.0),
            f"true points; the paper's plan {error['both']:.2g}, ours {error['optimised']:.2g}",
            "at most 5",
        ),
        Check(
            "tracking.final_error_px",
            "convergence to the desired value (Fig. 5f)",
            max(final.values()),
            "px",
            completed and within(max(final.values()), 0.0, 0.5),
            f"true points; the paper's plan {final['both']:.2g}, ours {final['optimised']:.2g}",
            "at most 0.5",
        ),
        Check(
            "tracking.final_pose_error_m",
            "correct realization of the positioning task",
            worst_pose,
            "m",
            completed and within(worst_pose, 0.0, 0.005),
            f"and {np.degrees(max(turn for _, turn in pose.values())):.2g} degrees",
            "at most 0.005",
        ),
    ]


def _classical(motions: Mapping[str, Motion]) -> list[Check]:
    image, mean = motions["image_based"], motions["image_based_mean"]
    pose, other = motions["position_based"], motions["position_based_on_object"]
    return [
        Check(
            "classical.image_based_fails",
            "classical visual servoing fails",
            float(image.ending is not Ending.ARRIVED),
            "",
            Ending.ARRIVED not in (image.ending, mean.ending),
            f"L at the current points: {image.reason}; mean of current and desired: "
            f"{mean.reason or 'arrives'}; true depths",
            "1: fails from the same start",
        ),
        Check(
            "classical.position_based_fails",
            "classical visual servoing fails",
            float(pose.ending is not Ending.ARRIVED),
            "",
            Ending.ARRIVED not in (pose.ending, other.ending),
            f"straight camera path: {pose.reason}; "
            f"object straight in the image: {other.reason or 'arrives'}",
            "1: fails from the same start",
        ),
    ]


def _misprint(joined: Sequence[Joined]) -> Check:
    right, printed = (sum(getattr(one, sign) for one in joined) for sign in ("minus", "plus"))
    return Check(
        "misprint.plus_in_l_w_inverse",
        "not in the paper: L_w^-1 as printed, with a plus, in the joint trajectory of section 3.3",
        printed / max(len(joined), 1),
        "",
        bool(joined) and right == len(joined) and 2 * printed < right,
        f"of {len(joined)} paths down the potential field, whose joints end at the goal: with the "
        f"plus {printed}, with a minus {right}",
        "less than half, and all with a minus",
    )


def _perturbed(ends: Sequence[End]) -> Check:
    rate = np.mean([end.ending is Ending.ARRIVED for end in ends])
    reasons = Counter(end.reason for end in ends if end.ending is not Ending.ARRIVED)
    return Check(
        "perturbed.success_rate",
        "nice degrees of robustness with respect to modeling errors",
        float(rate),
        "",
        within(float(rate), 0.97),
        f"{len(ends)} runs on projections with {NOISE_PX} px of noise: focal length ±5 %, "
        f"principal point ±15 px, d* ±20 %; {_again(ends)}{_listed(reasons)}",
        "at least 0.97",
    )


def _random(name: str, trials: Sequence[Trial]) -> Check:
    feasible = [trial for trial in trials if not trial.infeasible]
    rates = {method: success_rate(trials, method) for method in METHODS}
    others = tuple((LABELS[m], f"{rates[m]:.3f}") for m in METHODS if m != "optimised")
    ours = [trial.ends["optimised"] for trial in feasible]
    reasons = Counter(end.reason for end in ours if end.ending is not Ending.ARRIVED)
    return Check(
        f"{name}.success_rate",
        "convergence for all initial camera positions",
        rates["optimised"],
        "",
        within(rates["optimised"], 0.99),
        f"{len(trials)} starts on projections with {NOISE_PX} px of noise, "
        f"{len(trials) - len(feasible)} left out as proved infeasible (no chain of wrist "
        f"orientations from which all marks can be seen joins start and any goal configuration); "
        f"{_again(ours)}{_listed(reasons)}",
        "at least 0.99 of the feasible",
        others=Others("Share that arrives with other methods", others),
    )


def success_rate(trials: Sequence[Trial], method: str) -> float:
    """Return the part of the feasible starts from which a method arrives."""
    count = endings(trials, method)
    return count[Ending.ARRIVED] / max(count.total(), 1)


def _again(ends: Sequence[End]) -> str:
    """Return how many needed a second plan: made at rest, where a joint came close to its limit."""
    again = sum(end.parts > 1 for end in ends)
    return f"{again} planned again where a joint came within {100 * ROOM:g} % of its limit"


def _listed(reasons: Counter[str]) -> str:
    return "".join(f"; {count} × {reason}" for reason, count in reasons.most_common(4))


def _largest(path: PlannedPath, joint: int) -> float:
    return float(np.abs(path.joints_normalized[:, joint]).max())
