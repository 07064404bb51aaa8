"""A law that cannot work is refused before anything moves, with the key and the reason."""

from dataclasses import replace

import numpy as np
import pytest

from vergence.assembly import build_law, run_cell
from vergence.cell import load_cell
from vergence.control import ConstrainedLaw, ConstrainedSolver, ImageBased, OptimalTracking
from vergence.errors import InputError
from vergence.simulation import SimulatedDriver

SQUARE = str([[x, y, 0.0] for x in (-0.05, 0.05) for y in (-0.05, 0.05)])
ONE_JOINT = """<mujoco><worldbody><body name="flange" pos="0 0 1">
  <joint name="turn" type="hinge" axis="0 0 1" range="-170 170"/>
  <geom type="sphere" size="0.02" mass="1"/></body></worldbody></mujoco>"""


def complaint(cell, **settings):
    keys = {key.replace("__", "."): value for key, value in settings.items()}
    with pytest.raises(InputError) as caught:
        run_cell(load_cell(cell, {"duration_s": "0.2"} | keys), images=False)
    error = caught.value
    assert error.source.endswith("cell.toml")
    return error


@pytest.mark.parametrize("cell", ["puma560", "lippiello2005", "gantry"])
@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("view_margin_px", "400", "half the picture"),
        ("joint_margin", "0.6", "half of a joint's range"),
        ("depth_range", "[1.2, 2.0]", "a factor above 0 up to 1"),
        ("depth_range", "[0.5, 0.9]", "one from 1"),
        ("approach_rate_hz", "1000", "one command's share"),
        ("order", '["view", "view"]', "each constraint once"),
    ],
)
def test_limits_that_contradict_each_other(cell, key, value, said):
    error = complaint(cell, law__kind="constrained", **{f"law__{key}": value})
    assert error.key == f"law.{key}"
    assert said in error.allowed


@pytest.mark.parametrize(
    ("kind", "key", "value"),
    [
        ("constrained", "S", "-1.0"),
        ("constrained", "clearance_m", "-0.1"),
        ("constrained", "gain", "0.0"),
        ("constrained", "Q", "-1e-6"),
        ("plain", "gain", "-2.0"),
        ("plain", "R", "[1.0, -1.0, 1.0, 1.0, 1.0, 1.0]"),
        ("optimal_tracking", "Q", "0.0"),
        ("optimal_tracking", "S", "-1e-3"),
        ("position_based", "filter_hz", "0.0"),
        ("position_based", "null_space", "-1.0"),
        ("path_tracking", "gain", "0.0"),
    ],
)
def test_weights_of_the_wrong_sign(kind, key, value):
    cell = {"position_based": "lippiello2005", "path_tracking": "gantry"}.get(kind, "puma560")
    error = complaint(cell, law__kind=kind, **{f"law__{key}": value})
    assert error.key.startswith(f"law.{key}")


@pytest.mark.parametrize("kind", ["plain", "constrained", "optimal_tracking"])
def test_as_many_weights_as_axes(kind):
    law = {"law__kind": kind, "law__R": "[1.0, 2.0]"}
    if kind != "optimal_tracking":
        law["law__objective"] = "optimal_tracking"
    error = complaint("puma560", **law)
    assert (error.key, error.given) == ("law.R", "2 weights")
    assert "one for each of the axes" in error.allowed


def test_a_law_that_needs_a_depth_that_nothing_tells(monkeypatch):
    cell = load_cell("puma560", {"law.kind": "plain", "target.features": SQUARE})
    driver = SimulatedDriver(cell, images=False)
    frame = driver.first_frame("wrist")
    unknown = replace(frame, truth=replace(frame.truth, depth_m=np.full(4, np.nan)))
    monkeypatch.setattr(SimulatedDriver, "first_frame", lambda self, camera: unknown)
    with pytest.raises(InputError, match="a depth in metres") as caught:
        build_law(cell, driver)
    assert caught.value.key == "law.depth_m"


def written(tmp_path, law, height=-0.05):
    """A cell file with an arm of one upright joint over the board."""
    (tmp_path / "arm.xml").write_text(ONE_JOINT)
    board = load_cell("puma560").path.parent / "board.xml"
    (tmp_path / "cell.toml").write_text(f"""
name = "one"
duration_s = 0.2
[arms.arm]
model = "arm.xml"
body = "flange"
start_deg = [0.0]
[cameras.eye]
arm = "arm"
focal_px = [500.0, 500.0]
position_m = [0.0, 0.0, {height}]
rotation_rpy_deg = [180.0, 0.0, 0.0]
[target]
model = "{board}"
position_m = [0.0, 0.0, 0.2]
features = {SQUARE}
[task]
arm = "arm"
camera = "eye"
[law]
{law}
""")
    return str(tmp_path / "cell.toml")


@pytest.mark.parametrize(
    "law",
    ['kind = "plain"', 'kind = "constrained"', 'kind = "optimal_tracking"',
     'kind = "optimal_tracking"\naxes = ["x", "y", "rz"]'],
)  # fmt: skip
def test_an_arm_with_fewer_motions_than_the_law_asks(tmp_path, law):
    error = complaint(written(tmp_path, law))
    assert error.key == "task.camera"
    assert "1 joint" in str(error.given)
    assert "fewer axes" in error.allowed


def test_an_axis_that_the_arm_does_not_have(tmp_path):
    error = complaint(written(tmp_path, 'kind = "optimal_tracking"\naxes = ["x"]'))
    assert "no motion of its arm" in str(error.given)


def test_the_one_axis_that_it_has_is_served(tmp_path):
    path = written(tmp_path, 'kind = "optimal_tracking"\naxes = ["rz"]')
    assert run_cell(load_cell(path), images=False).outcome.time == pytest.approx(0.2)


def test_a_camera_offset_that_looks_away(tmp_path):
    error = complaint(written(tmp_path, 'kind = "plain"', height=-2.0))
    assert "does not see" in str(error.given)


def test_a_camera_on_a_link_that_does_not_move():
    error = complaint("puma560", cameras__wrist__body='"base"', law__kind="plain")
    assert "base" in str(error) or "joint" in str(error)


def test_whoever_builds_laws_by_hand_is_told_too():
    driver = SimulatedDriver(load_cell("puma560"), images=False)
    arm, camera = driver.world.arm_to_camera("wrist"), driver.cameras["wrist"]
    solver = ConstrainedSolver(arm, camera)
    with pytest.raises(InputError, match="depths above zero"):
        ConstrainedLaw(solver, ImageBased(camera), np.array([1.0, np.nan]))
    with pytest.raises(InputError, match="above zero"):
        ImageBased(camera, gain=0.0)
    with pytest.raises(InputError, match="one, or 6"):
        OptimalTracking(camera, R=[1.0, 2.0])
