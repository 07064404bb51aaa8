"""Arms from URDFs in installed packages: read as they are, servoed like any other."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.cell.locate import locate_model
from vergence.errors import InputError
from vergence.robot.urdf import read_urdf
from vergence.simulation.world import World

TETRAHEDRON = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
ROBOT = """<robot name="r">
  <link name="base"/>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="mast"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="0" velocity="1"/></joint>
  <link name="mast">
    <visual><geometry><mesh filename="package://robots/seen.{seen}"/></geometry></visual>
    <collision><geometry><box size="0.1 0.1 0.3"/></geometry></collision>
    <inertial><mass value="0"/>
      <inertia ixx="9" ixy="{ixy}" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  </link>
  <joint name="mount" type="fixed"><parent link="mast"/><child link="tool"/>
    <origin xyz="0 0 0.3"/></joint>
  <link name="tool"/>
  <joint name="finger" type="revolute"><parent link="tool"/><child link="jaw"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/><mimic joint="lift"/></joint>
  <link name="jaw"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
</robot>"""


def urdf(folder: Path, seen: str, ixy: float = 0.0) -> Path:
    (folder / "robots" / "urdf").mkdir(parents=True)
    (folder / "robots" / f"seen.{seen}").write_text(TETRAHEDRON)
    path = folder / "robots" / "urdf" / "r.urdf"
    path.write_text(ROBOT.format(seen=seen, ixy=ixy))
    return path


def test_a_urdf_keeps_fixed_links_as_bodies_and_locks_joints_beyond_the_last_one(tmp_path):
    model = read_urdf(urdf(tmp_path, "obj"), "tool").compile()
    assert [model.joint(i).name for i in range(model.njnt)] == ["lift"]
    assert model.body("tool").pos == pytest.approx([0, 0, 0.3])
    assert model.neq == 0
    assert model.jnt_range[0] == pytest.approx([0, 1])


@pytest.mark.parametrize(("seen", "drawn"), [("obj", "mesh"), ("dae", "box")])
def test_a_link_is_drawn_by_its_visual_shape_where_it_can_be_read(tmp_path, seen, drawn):
    model = read_urdf(urdf(tmp_path, seen), "tool").compile()
    shapes = model.geom_type[model.geom_bodyid == model.body("mast").id]
    wanted = {"mesh": mujoco.mjtGeom.mjGEOM_MESH, "box": mujoco.mjtGeom.mjGEOM_BOX}[drawn]
    assert shapes.tolist() == [int(wanted)]
    assert not model.geom_contype.any()


def test_an_inertia_that_no_body_can_have_is_made_one(tmp_path):
    model = read_urdf(urdf(tmp_path, "obj", ixy=30.0), "tool").compile()
    assert (model.body("mast").inertia > 0).all()


def test_a_missing_mesh_is_named(tmp_path):
    path = urdf(tmp_path, "obj")
    (tmp_path / "robots" / "seen.obj").unlink()
    with pytest.raises(InputError, match=r"package://robots/seen\.obj"):
        read_urdf(path)


@pytest.mark.parametrize("text", ["<robot>", "<mujoco/>"])
def test_what_is_no_urdf_is_refused(tmp_path, text):
    path = tmp_path / "r.urdf"
    path.write_text(text)
    with pytest.raises(InputError, match=r"r\.urdf"):
        read_urdf(path)


def test_a_package_that_is_not_installed_is_answered_with_how_to_install_it():
    with pytest.raises(InputError, match="run: pip install no-such-robots"):
        locate_model(Path("package:no-such-robots/arm.urdf"), Path(), "cell.toml", "arms.a.model")


def test_a_path_that_fits_no_file_or_several_of_a_package_is_refused():
    for path in ("no_such.urdf", "panda_description/meshes/collision/link.stl"):
        model = Path(f"package:example-robot-data/{path}")
        with pytest.raises(InputError, match="fits 0 files"):
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
        world.data.qpos[world.joint_addresses(name)] = q
        world.update()
        np.testing.assert_allclose(arm.forward_kinematics(q), world.camera_pose(camera), atol=1e-9)


@pytest.mark.parametrize(("name", "joints"), [("so100", 5), ("ur5", 6), ("panda", 7)])
def test_an_arm_from_a_urdf_keeps_a_moving_board_in_view_within_its_limits(name, joints):
    cell = load_cell(name, {"duration_s": "5"})
    listener = Extremes(name)
    result = run_cell(cell, [listener], images=False)
    assert result.outcome.succeeded
    assert result.summary["max_error_px"] < 60
    assert (listener.rate <= np.deg2rad(cell.arms[name].rate_max_deg_s) + 1e-6).all()
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


def test_a_spare_joint_is_drawn_to_better_postures():
    cell = load_cell("panda", {"target.motion": "{ kind = 'still' }", "duration_s": "8"})
    cell = cell.replace(arms={"panda": {"start_deg": twisted_start(cell, 0.8)}})
    measure = {}
    for S in (0.0, 1e-5):
        listener = Extremes("panda")
        assert run_cell(cell.replace(law={"S": S}), [listener], images=False).outcome.succeeded
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
