"""Simulated joints follow their set-points as far as the servo's lag explains."""

from pathlib import Path

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.control import Guard
from vergence.runtime import FollowingBound
from vergence.simulation.world import World

LINKS = """<mujoco><worldbody><body name="arm" pos="0 0 1">
  <joint name="turn" axis="0 0 1" range="-2 2" {extra}/>
  <geom size="0.05" mass="3"/>
  <body name="hand" pos="0.3 0 0"><joint name="roll" axis="1 0 0" range="-2 2" {extra}/>
  <geom type="capsule" fromto="0 0 0 0.05 0 0" size="0.02" mass="0.1"/></body>
</body></worldbody></mujoco>"""
CELL = """name = "servos"
duration_s = 1.0
[arms.a]
model = "arm.xml"
body = "hand"
start_deg = [0.0, 0.0]
{servo}
[cameras.c]
arm = "a"
focal_px = [600.0, 600.0]
[target]
model = "board.xml"
[task]
arm = "a"
camera = "c"
[law]
kind = "image_based"
"""
BOARD = '<mujoco><worldbody><body name="b"><geom size="0.1"/></body></worldbody></mujoco>'


def farthest(folder: Path, extra: str, servo: str = "") -> np.ndarray:
    """How far each joint gets from its set-points at rates at random, over its bound (n,)."""
    (folder / "arm.xml").write_text(LINKS.format(extra=extra))
    (folder / "board.xml").write_text(BOARD)
    (folder / "cell.toml").write_text(CELL.format(servo=servo))
    cell = load_cell(folder)
    world = World(cell)
    arm = world.arms["a"]
    bound = FollowingBound(servo_hz=cell.arms["a"].servo_bandwidth_hz).of(arm)
    guard = Guard(arm, world.joint_position("a"), 1.0 / cell.inner_rate_hz)
    rng = np.random.default_rng(1)
    worst = np.zeros(2)
    for tick in range(3000):
        if tick % 80 == 0:
            rates = rng.uniform(-1.0, 1.0, 2) * arm.rate_max
        setpoint = guard.step(rates)
        world.command("a", setpoint.position, setpoint.velocity)
        world.step()
        worst = np.maximum(worst, np.abs(world.joint_position("a") - setpoint.position))
    return worst / bound


@pytest.mark.parametrize(
    "extra", ["", 'frictionloss="1"', 'damping="5"', 'stiffness="20"', 'armature="0.1"']
)
def test_friction_damping_and_springs_of_a_small_joint_leave_no_drift(tmp_path, extra) -> None:
    assert (farthest(tmp_path, extra) < 0.5).all()


@pytest.mark.parametrize("servo_hz", [1.0, 2.0, 5.0])
def test_a_slow_servo_errs_no_more_than_its_bandwidth_explains(tmp_path, servo_hz) -> None:
    ratio = farthest(tmp_path, "", f"servo_bandwidth_hz = {servo_hz}")
    assert (ratio < 1.0).all()
    assert ratio.max() > 0.1
