"""What is drawn at random for a trial: where the arm starts, where the target is, how it moves."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.cell import Cell
from vergence.cell.joint_positions import goal_positions
from vergence.cell.schema import ReachTable
from vergence.errors import InputError, nearest
from vergence.experiments.goal import Goal, listed, merged, placed
from vergence.geometry import so3_exp
from vergence.signals import FrameTruth
from vergence.simulation import SimulatedDriver, placement_pose

Drawn = Literal["starts", "targets", "motions"]
_MOST_TRIES = 400  # draws for one trial
_SETTLE_S = 2.0  # after the target has stopped


@dataclass(frozen=True, slots=True)
class Sampling:
    """What is drawn, and from how wide a range.

    Raises:
        InputError: if there is nothing of a name to draw.
    """

    vary: Sequence[str] = ("starts",)  # of `Drawn`
    spread: float = 0.2  # share of what starts and targets are drawn from
    speed_m_s: float = 0.1  # the fastest motion

    def __post_init__(self) -> None:
        for name in self.vary:
            if name not in get_args(Drawn):
                raise InputError("vary", "", name, nearest(name, get_args(Drawn)))

    def changes(self, cell: Cell, goal: Goal, count: int, seed: int) -> list[dict[str, Any]]:
        """Return tables of the cell to replace, one set a trial.

        Joints are drawn evenly from a share of their ranges around the cell's own start, half a
        turn for those without limits or with a range beyond it; places of the target within a share
        of its distance from the camera, turned by up to that share of a right angle; motions in any
        level direction, at up to the fastest speed. Each draw is made until every feature is in the
        image at the start, and from where a goal's image was taken. A trial depends on the seed
        and its number only.

        Args:
            cell: the cell.
            goal: its features.
            count: how many.
            seed: of the draws.

        Raises:
            InputError: if the target cannot be moved, or no draw is found that is in view.
        """
        _refuse(self.vary, cell)
        driver = SimulatedDriver(cell.replace(**goal.tables), images=False)
        try:
            driver.look_for(np.array(goal.features))
            return [
                self._one(cell, driver, np.random.default_rng([seed, number]))
                for number in range(count)
            ]
        finally:
            driver.close()

    def _one(self, cell: Cell, driver: SimulatedDriver, rng: np.random.Generator) -> dict[str, Any]:
        name, camera = cell.task.arm, cell.task.camera
        arm, own = driver.arms[name], driver.world.joint_position(name)
        reach = 0.5 * self.spread * np.minimum(arm.q_max - arm.q_min, np.pi)
        low, high = np.maximum(own - reach, arm.q_min), np.minimum(own + reach, arm.q_max)
        T_target = placement_pose(cell.target)
        away = np.linalg.norm(driver.world.camera_pose(camera)[:3, 3] - T_target[:3, 3])
        for _ in range(_MOST_TRIES):
            q, T = own, T_target
            if "starts" in self.vary:
                q = rng.uniform(low, high)
            if "targets" in self.vary:
                T = _moved(T_target, self.spread, float(away), rng)
                driver.world.move_target(T)
                driver.world.update()
            seen_from = [q]
            if isinstance(cell.task, ReachTable):
                seen_from.append(goal_positions(cell, arm))
            truths = [driver.frame_at(camera, name, place).truth for place in seen_from]
            if all(t is not None and _in_image(t, driver.cameras[camera], cell) for t in truths):
                break
        else:
            given = f"{self.spread:g}: {_MOST_TRIES} draws, and none of them sees the target"
            raise InputError("spread", "", given, "a smaller spread")
        changes: dict[str, Any] = {}
        if "starts" in self.vary:
            unit = np.where(arm.sliding, 1.0, np.pi / 180)
            changes = {"arms": {name: {"start_deg": listed(q / unit)}}}
        if "targets" in self.vary:
            changes = merged(changes, {"target": placed(T)})
        if "motions" in self.vary:
            changes = merged(changes, {"target": {"motion": self._motion(cell, rng)}})
        return changes

    def _motion(self, cell: Cell, rng: np.random.Generator) -> dict[str, Any]:
        heading = rng.uniform(-np.pi, np.pi)
        speed = self.speed_m_s * rng.uniform(0.2, 1.0)
        time = max(cell.duration_s - _SETTLE_S, 0.5 * cell.duration_s)
        return {
            "kind": "line",
            "velocity_m_s": listed((speed * np.cos(heading), speed * np.sin(heading), 0.0)),
            "distance_m": round(speed * time, 9),
        }


def _refuse(vary: Sequence[str], cell: Cell) -> None:
    if cell.target.carried_by is not None and {"targets", "motions"} & set(vary):
        given = f"{', '.join(vary)}, but the target is held by {cell.target.carried_by}"
        raise InputError("vary", "", given, "starts")
    if isinstance(cell.task, ReachTable) and "motions" in vary:
        raise InputError("vary", "", "motions, but the task is to reach", "starts, targets")


def _moved(T: FloatArray, spread: float, away: float, rng: np.random.Generator) -> FloatArray:
    moved = T.copy()
    moved[:3, 3] += spread * away * rng.uniform(-1.0, 1.0, 3)
    moved[:3, :3] = T[:3, :3] @ so3_exp(spread * np.pi / 2 / np.sqrt(3) * rng.uniform(-1, 1, 3))
    return moved


def _in_image(truth: FrameTruth, camera: Camera, cell: Cell) -> bool:
    """Return whether all features are in the image; of an object some may be on its far side."""
    if cell.task.kind != "follow":
        return bool(truth.visible.all())
    inside = np.isfinite(truth.points_px).all() and camera.contains(truth.points_px).all()
    return bool(inside and truth.visible.any())
