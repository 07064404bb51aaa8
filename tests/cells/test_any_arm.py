"""Arms from URDFs in installed packages: read as they are, servoed like any other."""

from pathlib import Path

import numpy as np
import pytest

from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.cell.locate import locate_model
from vergence.errors import InputError
from vergence.simulation.world import World


def test_a_package_that_is_not_installed_is_answered_with_how_to_install_it():
    with pytest.raises(InputError, match="run: pip install no-such-robots"):
        locate_model(Path("package:no-such-robots/arm.urdf"), Path(), "cell.toml", "arms.a.model")


def test_a_path_that_fits_no_file_or_several_of_a_package_is_refused():
    for path in ("no_such.urdf", "panda_description/meshes/collision/link.stl"):
        model = Path(f"package:example-robot-data/{path}")
        with pytest.raises(InputError, match="no file of example-robot-data ends with that"):
            locate_model(model, Path(), "cell.toml", "arms.a.model")
    with pytest.raises(InputError, match="package:NAME/PATH"):
        locate_model(Path("package:numpy"), Path(), "cell.toml", "arms.a.model")


def test_other_models_lie_beside_the_cell():
    assert locate_model(Path("a.xml"), Path("/cells"), "", "") == Path("/cells/a.xml")
    assert locate_model(Path("/b/a.xml"), Path("/cells"), "", "") == Path("/b/a.xml")


@pytest.mark.parametrize(("name", "joints"), [("so100", 5), ("ur5", 6), ("panda", 7)])
def test_the_chain_of_a_urdf_agrees_with_mujoco_in_random_postures(name, joints):
    cell = load_cell(name)
    world = World(cell)
    arm, camera = world.arms[name], cell.task.camera
    assert arm.joint_count == joints
    rng = np.random.default_rng(5)
    for _ in range(5):
        q = rng.uniform(arm.q_min, arm.q_max)
        world.place_arm(name, q)
        np.testing.assert_allclose(arm.forward_kinematics(q), world.camera_pose(camera), atol=1e-9)


@pytest.mark.parametrize(("name", "joints"), [("so100", 5), ("ur5", 6), ("panda", 7)])
def test_an_arm_from_a_urdf_keeps_a_moving_board_in_view_within_its_limits(name, joints):
    cell = load_cell(name, {"duration_s": "5"})
    listener = Extremes(name)
    result = run_cell(cell, [listener], images=False)
    assert result.outcome.succeeded
    assert result.summary["max_error_px"] < 60
    assert (listener.rate <= World(cell).arms[name].rate_max + 1e-6).all()
    assert not any("no solution" in name for name in listener.active)


def test_a_urdf_is_servoed_on_rendered_images():
    result = run_cell(load_cell("panda", {"duration_s": "2.5"}))
    assert result.outcome.succeeded
    assert result.summary["max_drift_px"] < 1.0


def twisted_start(cell, turn):
    """Joints in degrees that hold the camera as the cell's start does, the elbow turned aside."""
    world = World(cell)
    arm, q = world.arms["panda"], world.joint_position("panda").copy()
    for _ in range(200):
        q += turn / 200 * np.linalg.svd(arm.jacobian(q))[2][-1]
    return np.rad2deg(q).tolist()


def test_a_redundant_joint_moves_to_better_postures():
    cell = load_cell("panda", {"target.motion": "{ kind = 'stationary' }", "duration_s": "8"})
    cell = cell.replace(arms={"panda": {"start_deg": twisted_start(cell, 0.8)}})
    measure = {}
    for S in (0.0, 1e-5):
        listener = Extremes("panda")
        assert run_cell(
            cell.replace(law={"solver": {"S": S}}), [listener], images=False
        ).outcome.succeeded
        measure[S] = listener.manipulability
    assert measure[0.0][-1] == pytest.approx(measure[0.0][0], rel=1e-3)
    assert measure[1e-5][-1] > 1.05 * measure[0.0][-1]


class Extremes:
    """A listener that keeps the fastest set-points and what the law said."""

    def __init__(self, arm):
        self.arm, self.rate, self.active, self.manipulability = arm, 0.0, set(), []

    def begin(self, info):
        pass

    def tick(self, record):
        for command in record.commands.values():
            self.rate = np.maximum(self.rate, np.abs(command.velocity))
            self.active |= set(command.active)
            self.manipulability.append(command.manipulability)

    def event(self, time, name, text):
        pass

    def close(self, outcome, summary):
        pass
