"""Cells that need no physics: an arm that moves as it is told, and nothing else that moves it."""

from typing import Any

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.assembly import assemble_parts
from vergence.cell import Cell
from vergence.cell.joint_positions import joint_positions
from vergence.cell.schema import TrackTable
from vergence.control import OptimalTracking, PseudoInverse, ServoSettings
from vergence.experiments.batch import KinematicRun
from vergence.geometry import transform_points
from vergence.robot import Clearance
from vergence.runtime.timeouts import Timeouts
from vergence.signals import Outcome
from vergence.simulation import KinematicCell, SimulatedDriver, target_poses
from vergence.simulation.as_built import as_built
from vergence.simulation.cell_model import CellModel
from vergence.simulation.kinematic_driver import Sees
from vergence.vision import CurveTracking


def is_ideal(cell: Cell) -> bool:
    """Return whether a cell is one arm that tracks known features with the one camera it carries.

    A planned way to them is not ideal: its runs are made in physics, where they may plan again.
    """
    camera = cell.cameras[cell.task.camera]
    return (
        isinstance(cell.task, TrackTable)
        and cell.task.approach == "direct"
        and cell.task.until is None
        and len(cell.arms) == len(cell.cameras) == 1
        and camera.arm == cell.task.arm
        and not camera.blind_s
        and not renders(cell)
        and len(cell.targets) == 1
        and cell.target.features is not None
        and not isinstance(cell.task.tracker, CurveTracking)
        and cell.target.carried_by is None
        and cell.arms[cell.task.arm].motion is None
    )


def renders(cell: Cell) -> bool:
    """Return whether a cell's runs look through rendered images: a camera says how bad they are."""
    return any(cell.cameras[name].imaging is not None for name in cell.watched)


def is_quick(cell: Cell) -> bool:
    """Return whether the batch kernel makes its runs sooner than other processes start."""
    law = cell.law
    if not isinstance(law, ServoSettings):
        return False
    few = len(cell.target.features or ()) < 4  # more of them give the depth
    as_it_is = law.feed_forward is False and not law.prediction and (few or law.depth is not None)
    alone = len(law.objectives) == 1 and law.objectives[0].weight == 1.0
    return (
        is_ideal(cell)
        and alone
        and isinstance(law.objective, OptimalTracking)
        and law.objective.measure == "squared"
        and isinstance(law.solver, PseudoInverse)
        and as_it_is
    )


class KinematicRuns:
    """Makes ideal runs of cells; those with the same models share one compiled world."""

    def __init__(self) -> None:
        self._key = ""
        self._made: tuple[SimulatedDriver, CellModel] | None = None
        self._clearance: Clearance | None = None  # of the same world

    def run_of(self, cell: Cell) -> KinematicRun:
        """Return the run of a cell that `is_ideal`.

        Raises:
            InputError: if the cell cannot be run as it is written.
        """
        driver, model = self._driver_of(cell)
        arm, camera = cell.task.arm, cell.task.camera
        poses = target_poses(as_built(cell).target, cell.target.motion, cell.seed)
        given = cell.arms[arm].start_deg
        start = joint_positions(cell, f"arms.{arm}.start_deg", given, driver.arms[arm])
        driver.world.move_target(poses(np.zeros(1))[0])
        driver.world.place_arm(arm, start)
        driver.restart_cameras()
        parts = assemble_parts(cell, driver, images=False, model=model)
        assert not isinstance(parts, Outcome)
        desired = parts.planner.reference(0.0)
        assert desired.points_px is not None
        table = cell.cameras[camera]
        ideal = KinematicCell(
            driver.world.arm_to_camera(camera),
            driver.cameras[camera],
            start,
            poses,
            driver.features,
            rate_hz=table.rate_hz,
            inner_rate_hz=cell.inner_rate_hz,
            latency_frames=table.latency_frames,
            seed=cell.seed,
            sees=_eyesight(driver, arm, camera),
        )
        assert isinstance(cell.task, TrackTable), "an ideal cell tracks"
        timeouts = Timeouts(cell.task.image_timeout_s, cell.task.target_timeout_s)
        if self._clearance is None:
            self._clearance = parts.context.clearance
        return KinematicRun(
            ideal,
            parts.law,
            desired.points_px,
            cell.duration_s,
            timeouts=timeouts,
            noise_px=cell.task.noise_px,
            desired_depth_m=desired.desired_depth_m,
            clearance=self._clearance,
        )

    def _driver_of(self, cell: Cell) -> tuple[SimulatedDriver, CellModel]:
        key = as_built(cell).model_dump_json(exclude=_apart_from(cell))
        if self._made is None or key != self._key:
            self._clearance = None
            self._made, self._key = (
                (SimulatedDriver(cell, images=False), CellModel(cell, hulls=True)),
                key,
            )
        return self._made


def _eyesight(driver: SimulatedDriver, arm: str, camera: str) -> Sees:
    """Return what tells which features no surface hides."""
    world, features = driver.world, driver.features

    def sees(q: FloatArray, T_world_target: FloatArray) -> BoolArray:
        world.move_target(T_world_target)
        world.place_arm(arm, q)
        return world.sees(camera, transform_points(T_world_target, features))

    return sees


def _apart_from(cell: Cell) -> dict[str, Any]:
    """Return what of a cell is not in its world, or is set in it at each run's start."""
    arms = {name: {"start_deg"} for name in cell.arms}
    rest = dict.fromkeys(("law", "laws", "task", "duration_s", "seed"), True)
    targets = {name: {"motion"} for name in cell.targets}
    return {"arms": arms, "targets": targets, **rest}
