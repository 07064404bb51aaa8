"""A law that cannot work is refused before anything moves, with the key and the reason."""

import numpy as np
import pytest

from vergence.assembly import run_cell
from vergence.camera import Camera
from vergence.cell import load_cell
from vergence.control import ImageBased, Servo
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


CONSTRAINED = {
    "puma560": "image_based", "lippiello2005": "position_based", "gantry": "image_based",
}  # fmt: skip


@pytest.mark.parametrize("cell", CONSTRAINED)
@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("view_margin_px", "400", "half the image"),
        ("joint_margin", "0.6", "less than 0.5"),
        ("depth_range", "[1.2, 2.0]", "at most 1"),
        ("depth_range", "[0.5, 0.9]", "at least 1"),
        ("approach_rate_hz", "1000", "one command's share"),
        ("order", '["view", "view"]', "each limit once"),
    ],
)
def test_limits_that_contradict_each_other(cell, key, value, said):
    law = f'{{ kind = "{CONSTRAINED[cell]}" }}'
    error = complaint(cell, law=law, **{f"law__limits__{key}": value})
    assert error.key.startswith(f"law.limits.{key}")
    assert said in error.allowed


@pytest.mark.parametrize(
    ("kind", "key", "value"),
    [
        ("image_based", "solver.S", "-1.0"),
        ("image_based", "limits.clearance_m", "-0.1"),
        ("image_based", "gain", "0.0"),
        ("image_based", "gain", "1e9"),
        ("image_based", "damping", "nan"),
        ("image_based", "interaction", "desird"),
        ("image_based", "depth_m", "-1"),
        ("optimal_tracking", "Q", "0.0"),
        ("optimal_tracking", "R", "[1.0, -1.0, 1.0, 1.0, 1.0, 1.0]"),
        ("optimal_tracking", "S", "-1e-3"),
        ("position_based", "filter_hz", "-5"),
        ("position_based", "null_space_rate", "-1.0"),
    ],
)
def test_numbers_out_of_their_range(kind, key, value):
    cell = "lippiello2005" if kind == "position_based" else "puma560"
    law = f'{{ kind = "{kind}", solver = {{ kind = "quadratic_program" }} }}'
    error = complaint(cell, law=law, **{f"law__{key.replace('.', '__')}": value})
    assert error.key.startswith(f"law.{key}")


@pytest.mark.parametrize("solver", ["pseudo_inverse", "quadratic_program"])
def test_as_many_weights_as_axes(solver):
    law = f'{{ kind = "optimal_tracking", solver = "{solver}", R = [1.0, 2.0] }}'
    error = complaint("puma560", law=law)
    assert (error.key, error.given) == ("law.R", "2 weights")
    assert "one for each of the axes" in error.allowed


def test_another_kind_keeps_the_keys_that_it_has_and_refuses_the_others_by_name():
    kept = load_cell("ur5", {"law.solver": "pseudo_inverse", "law.limits": ""})
    assert kept.law.objective.gain == 4.0
    error = complaint("puma560", law__kind="image_based")
    assert error.key == "law.axes"
    assert "image_based does not have" in str(error.given)
    assert "--set law.axes= removes it" in error.allowed
    error = complaint("ur5", target__motion__kind="stationary")
    assert error.key == "target.motion.amplitude_m"
    assert "--set target.motion.amplitude_m= removes it" in error.allowed


def test_limits_beside_a_solver_that_keeps_none():
    error = complaint("ur5", law__solver="pseudo_inverse")
    assert error.key == "law.limits"
    assert "quadratic_program" in error.allowed


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
    ['kind = "image_based"\nsolver = "pseudo_inverse"', 'kind = "image_based"',
     'kind = "optimal_tracking"', 'kind = "optimal_tracking"\naxes = ["x", "y", "rz"]'],
)  # fmt: skip
def test_an_arm_with_fewer_motions_than_the_law_asks(tmp_path, law):
    error = complaint(written(tmp_path, law))
    assert error.key == "task.camera"
    assert "1 joint" in str(error.given)
    assert "fewer axes" in error.allowed


def test_an_axis_that_the_arm_does_not_have(tmp_path):
    error = complaint(written(tmp_path, 'kind = "optimal_tracking"\naxes = ["x"]'))
    assert "has no motion that reduces the error" in str(error.given)


def test_the_one_axis_that_it_has_is_served(tmp_path):
    path = written(tmp_path, 'kind = "optimal_tracking"\naxes = ["rz"]')
    assert run_cell(load_cell(path), images=False).outcome.time == pytest.approx(0.2)


def test_a_camera_offset_that_looks_away(tmp_path):
    error = complaint(written(tmp_path, 'kind = "image_based"', height=-2.0))
    assert "does not see" in str(error.given)


def test_a_camera_on_a_link_that_does_not_move():
    error = complaint("puma560", cameras__wrist__body='"base"', law='{ kind = "image_based" }')
    assert "base" in str(error) or "joint" in str(error)


def test_python_gives_the_same_answers():
    for wrong in ({"gain": 0.0}, {"interaction": "desird"}, {"damping": np.nan}, {"gian": 1.0}):
        with pytest.raises(InputError) as caught:
            ImageBased(**wrong)
        assert caught.value.key == next(iter(wrong))
    arm = SimulatedDriver(load_cell("puma560"), images=False).world.arm_to_camera("wrist")
    with pytest.raises(InputError, match="positive depths"):
        Servo(arm, Camera(640, 480, 600, 600, 319.5, 239.5), ImageBased(), depth_m=[1.0, np.nan])
