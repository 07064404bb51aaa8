"""Section 6 of [Mezouar2001] on the gantry cell: plan from two images, then track the plan."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.assembly import run_cell
from vergence.assembly.law_context import LawContext
from vergence.assembly.started_driver import StartedDriver
from vergence.assembly.tasks.reach import measure_twice, plan_reach
from vergence.cell import Cell
from vergence.cell.joint_positions import goal_positions
from vergence.cell.schema import ReachTable
from vergence.errors import VergenceError
from vergence.geometry import se3_inverse, so3_angle
from vergence.planning import Path, PlanFailure, PotentialFieldPlanner, Trajectory
from vergence.runtime import Run
from vergence.runtime.results import ArmTrace, CameraTrace
from vergence.simulation import SimulatedDriver
from vergence.studies.reach_scene import Scene

SETTLE_S = 4.0  # after a plan's end
PLANNERS = {"both": "potential_field", "optimised": "optimised"}  # of the paths that are run


@dataclass(frozen=True, slots=True)
class Realised:
    """A plan and what came of it."""

    scene: Scene
    trajectory: Trajectory
    run: Run

    @property
    def camera(self) -> CameraTrace:
        """What the camera saw."""
        return self.run.cameras[self.run.info.task_camera]

    @property
    def motion(self) -> ArmTrace:
        """How the arm moved."""
        (arm,) = self.run.arms.values()
        return arm

    @property
    def tracking_error_px(self) -> FloatArray:
        """Distance of each point from its place on the plan, (K, N)."""
        return _distances(self.camera.true_px - self.camera.desired_px)

    @property
    def goal_error_px(self) -> FloatArray:
        """Distance of each point from where the desired image has it, (K, N)."""
        return _distances(self.camera.true_px - self.scene.goal_px)

    @property
    def image_margin_px(self) -> float:
        """Smallest distance of a point to the border of the image; negative outside."""
        camera, px = self.scene.camera, self.camera.true_px
        far = np.array([camera.width - 0.5, camera.height - 0.5]) - px
        return float(min((px + 0.5).min(), far.min()))

    @property
    def joints_normalized(self) -> FloatArray:
        """Joint positions with their limits at -1 and 1, (K, n)."""
        return self.scene.arm.normalized(self.motion.position)

    @property
    def joint_margin(self) -> float:
        """Smallest distance to a joint limit, part of half the range."""
        return float(1.0 - np.abs(self.joints_normalized).max())

    @property
    def final_pose_error(self) -> tuple[float, float]:
        """How far the camera ends from where the desired image was taken, m and rad."""
        missing = se3_inverse(self.scene.T_world_goal.copy()) @ self.camera.T_world_camera[-1]
        return float(np.linalg.norm(missing[:3, 3])), so3_angle(missing)


@dataclass(frozen=True, slots=True)
class Section6:
    """The paths of the section, and the runs of those that can be run."""

    scene: Scene
    end_images: tuple[ImageArray | None, ImageArray | None]  # from start and goal
    paths: Mapping[str, Path]  # straight, visibility_only, both, optimised
    runs: Mapping[str, Realised]  # both, optimised


def plan_section6(cell: Cell, images: bool) -> Section6:
    """Look twice and plan every path of the section; nothing is run yet.

    Raises:
        VergenceError: if there is no plan that keeps every constraint.
    """
    task = cell.task
    assert isinstance(task, ReachTable)
    driver = SimulatedDriver(cell, images)
    try:
        started = StartedDriver(driver, cell.watched)
        context = LawContext.of(cell, started)
        pair = measure_twice(context, task, started, images)
        if isinstance(pair, PlanFailure):
            raise VergenceError(f"{cell.name}: {pair}")
        plans = {
            name: plan_reach(context, _with_planner(cell, planner), pair)
            for name, planner in PLANNERS.items()
        }
        goal = goal_positions(cell, driver.arms[task.arm])
        shown = (
            driver.first_frame(task.camera).image,
            driver.frame_at(task.camera, task.arm, goal).image,
        )
    finally:
        driver.close()
    for plan in plans.values():
        if not isinstance(plan, Path):
            raise VergenceError(f"{cell.name}: {plan}")
    kept = {name: plan for name, plan in plans.items() if isinstance(plan, Path)}
    problem = kept["both"].problem
    broken = {
        "straight": PotentialFieldPlanner(gain_image=0.0, gain_joint=0.0).walk(problem),
        "visibility_only": PotentialFieldPlanner(gain_joint=0.0).walk(problem),
    }
    return Section6(Scene.of(cell), shown, {**broken, **kept}, {})


def _with_planner(cell: Cell, planner: str) -> ReachTable:
    task = cell.replace(task={"planner": planner}).task
    assert isinstance(task, ReachTable)
    return task


def run_section6(cell: Cell, planned: Section6, name: str, images: bool) -> Realised:
    """Run a plan of the section, "both" or "optimised", as the cell does."""
    task = cell.task
    assert isinstance(task, ReachTable)
    trajectory = Trajectory.of(planned.paths[name], task.camera_speed_m_s)
    changed = cell.replace(
        task={"planner": PLANNERS[name]}, duration_s=trajectory.duration + SETTLE_S
    )
    return Realised(planned.scene, trajectory, run_cell(changed, images=images))


def _distances(differences: FloatArray) -> FloatArray:
    sizes: FloatArray = np.linalg.norm(differences, axis=-1)
    return sizes
