"""approach = "auto": planned where goal and scale are known, refused before moving, or direct."""

from typing import Any

import numpy as np
import pytest

import vergence as vg
from vergence.arrays import FloatArray
from vergence.cell import load_cell
from vergence.geometry import se3, so3_exp, transform_points
from vergence.signals import OutcomeKind
from vergence.simulation import SimulatedDriver

FEATURES = np.array(load_cell("ur5").target.features)
TARGET = {"motion": "stationary"}


def desired_after(turn_deg: float, tilt_deg: float = 0.0) -> list[list[float]]:
    """Return where a UR5's camera sees the features after the target has turned before it."""
    driver = SimulatedDriver(load_cell("ur5").replace(target=TARGET), images=False)
    truth = driver.first_frame("wrist").truth
    assert truth is not None
    T = np.linalg.inv(truth.T_world_camera) @ truth.T_world_target
    turned = so3_exp(np.radians([tilt_deg, 0.0, 0.0])) @ so3_exp(np.radians([0.0, 0.0, turn_deg]))
    R = np.ascontiguousarray(turned @ T[:3, :3])
    goal = se3(R, np.array([0.0, 0.0, T[2, 3]]) - R @ FEATURES.mean(axis=0))
    points: FloatArray = driver.cameras["wrist"].project(transform_points(goal, FEATURES))
    driver.close()
    listed: list[list[float]] = points.tolist()
    return listed


def run(desired: list[list[float]], **task: Any) -> vg.Run:
    return vg.run(
        "ur5",
        images=False,
        duration_s=12.0,
        target=TARGET,
        task={"desired": desired, **task},
    )


def test_a_goal_after_a_large_turn_is_reached_along_a_plan() -> None:
    result = run(desired_after(150.0), approach="auto")
    assert result.outcome.succeeded, str(result.outcome)
    assert result.summary["final_error_px"] < 0.5


def test_a_goal_from_behind_is_refused_before_anything_moves() -> None:
    result = run(desired_after(0.0, tilt_deg=120.0), approach="auto")
    assert result.outcome.kind is OutcomeKind.INFEASIBLE
    assert "behind" in result.outcome.reason
    assert result.outcome.time == 0.0


@pytest.mark.parametrize("desired", ["initial", "centred"])
def test_a_goal_without_stated_points_is_served_without_a_plan(desired: str) -> None:
    task = {"desired": desired, "approach": "auto"}
    result = vg.run("ur5", images=False, duration_s=2.0, target=TARGET, task=task)
    assert result.outcome.succeeded, str(result.outcome)
