"""`import vergence as vg`: its names, how light it is, and what it says of mistakes."""

import ast
import subprocess
import sys
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import vergence as vg
from vergence.errors import ShapeError

STUB = Path(vg.__file__).with_suffix(".pyi")


def test_every_public_name_is_there_and_typed() -> None:
    typed = {
        alias.asname
        for node in ast.parse(STUB.read_text()).body
        for alias in getattr(node, "names", [])
    }
    assert typed == {*vg.__all__, "transforms"}
    for name in (*vg.__all__, "transforms"):
        assert getattr(vg, name) is not None
        assert name in dir(vg)


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'ImageBasde'"):
        _ = vg.ImageBasde


def test_a_name_is_loaded_when_it_is_first_used() -> None:
    program = "import sys, vergence as vg; before = 'numpy' in sys.modules; vg.Camera; "
    program += "print(before, 'numpy' in sys.modules, 'mujoco' in sys.modules)"
    search = f"import sys; sys.path.insert(0, {str(STUB.parents[1])!r}); {program}"
    told = subprocess.run(
        [sys.executable, "-c", search], check=True, capture_output=True, text=True
    )
    assert told.stdout.split() == ["False", "True", "False"]


def test_a_run_is_the_cell_with_some_of_its_values_changed() -> None:
    motion = {"motion": {"velocity_m_s": [0.2, 0, 0]}}
    run = vg.run("puma560", images=False, seed=4, duration_s=0.3, target=motion)
    assert run.outcome.kind is vg.OutcomeKind.COMPLETED
    assert run.info.seed == 4
    target = run.cameras["wrist"].T_world_target[:, :3, 3]
    speed = np.diff(target, axis=0) / np.diff(run.cameras["wrist"].time)[:, None]
    np.testing.assert_allclose(speed[-1], [0.2, 0.0, 0.0], atol=1e-6)
    assert "# set: target.motion.velocity_m_s = [0.2, 0, 0]" in run.info.text
    again = vg.run(vg.load_cell("puma560"), images=False, seed=4, duration_s=0.3, target=motion)
    np.testing.assert_array_equal(again.times, run.times)


@pytest.mark.parametrize(
    ("cell", "changes", "said"),
    [
        ("pumma", {}, "did you mean puma560"),
        ("puma560", {"duration_s": -1}, "duration_s"),
        ("puma560", {"target": {"motion": {"velocity": [1, 0, 0]}}}, "did you mean velocity_m_s"),
        ("puma560", {"laws_": {}}, "did you mean laws"),
    ],
)
def test_a_mistake_in_a_run_is_said_in_one_sentence(cell: str, changes: dict, said: str) -> None:
    with pytest.raises(vg.InputError, match=said) as error:
        vg.run(cell, images=False, **changes)
    assert len(str(error.value).splitlines()) == 1


def test_laws_are_compared_in_one_table() -> None:
    table = vg.compare(
        "puma560", ["image_based", "constrained"], starts=2, spread=0.1, duration_s=0.5,
        task={"feature_count": 4}, target={"motion": {"kind": "stationary"}},
    )  # fmt: skip
    assert len(table.runs) == 4
    assert table.runs[3].labels == {"law": "constrained", "start": 1}
    assert table.runs[3].outcome.startswith(table.runs[3].ending)
    assert repr(table) == str(table)
    lines = str(table).splitlines()
    assert lines[0].split()[0] == "law"
    assert [line.split()[0] for line in lines[2:]] == ["image_based", "constrained"]
    narrow = StringIO()
    Console(file=narrow, width=80).print(table)
    assert "collision" not in narrow.getvalue()  # no run ended so
    assert all(word in narrow.getvalue() for word in ("converged", "off goal", "path (m)"))
    frame = table.to_frame()
    assert list(frame["law"]) == ["image_based"] * 2 + ["constrained"] * 2
    assert frame["final_error_px"].notna().all()


def test_a_comparison_of_a_law_that_is_not_there_names_those_that_are() -> None:
    with pytest.raises(vg.InputError, match="did you mean constrained"):
        vg.compare("puma560", ["constraint"], starts=1)


def test_a_study_that_is_not_there_names_those_that_are() -> None:
    with pytest.raises(vg.InputError, match="did you mean nelson1995"):
        vg.reproduce("nelson95")


def test_a_path_is_planned_or_refused() -> None:
    path = vg.plan("gantry", images=False)
    assert path
    assert path.image_margin_px > 0
    with pytest.raises(vg.InputError, match=r"task\.kind"):
        vg.plan("puma560")


def test_a_run_in_memory_has_a_report(tmp_path: Path) -> None:
    run = vg.run("puma560", images=False, duration_s=0.2)
    page = vg.report(run, tmp_path / "page.html")
    assert page.read_text(encoding="utf-8").count("<section") > 3
    assert str(run.outcome.kind) in page.read_text(encoding="utf-8")


def test_a_camera_has_its_principal_point_in_the_middle() -> None:
    camera = vg.Camera(640, 480, focal_px=600)
    np.testing.assert_array_equal(camera.normalize([[319.5, 239.5]]), [[0.0, 0.0]])
    assert camera.matrix.tolist() == [[600.0, 0.0, 319.5], [0.0, 600.0, 239.5], [0.0, 0.0, 1.0]]
    with pytest.raises(vg.InputError, match="given neither; allowed: one of them"):
        vg.Camera(640, 480)
    with pytest.raises(ShapeError, match=r"points_px has shape \(2,\)"):
        camera.normalize([300, 180])
    with pytest.raises(vg.InputError, match="an array of numbers"):
        camera.normalize([["a", "b"]])


URDF = """
<robot name="two_joints">
  <link name="base"/><link name="upper"/><link name="tool0"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 0.5"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="1" effort="1"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="upper"/><child link="tool0"/><origin xyz="0.3 0 0"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.4" velocity="0.2" effort="1"/>
  </joint>
</robot>
"""


@pytest.fixture
def arm(tmp_path: Path) -> vg.Arm:
    path = tmp_path / "arm.urdf"
    path.write_text(URDF)
    return vg.Arm.from_urdf(path, tip="tool0")


def test_an_arm_is_read_from_a_urdf_and_ends_where_its_tip_is_put(arm: vg.Arm) -> None:
    assert arm.names == ("turn", "slide")
    assert arm.q_max.tolist() == [2.0, 0.4]
    turned = [[0, -1, 0, 0.1], [1, 0, 0, 0], [0, 0, 1, 0.2], [0, 0, 0, 1]]
    eye = arm.with_tip(turned)
    q = [0.3, 0.1]
    np.testing.assert_allclose(eye.forward_kinematics(q), arm.forward_kinematics(q) @ turned)
    step, J = 1e-6, eye.jacobian(q)
    T = eye.forward_kinematics(q)
    for joint in range(2):
        ahead = eye.forward_kinematics(np.add(q, step * np.eye(2)[joint]))
        twist = vg.transforms.se3_log(np.linalg.inv(T) @ ahead) / step
        np.testing.assert_allclose(J[:, joint], twist, atol=1e-5)


def test_a_mistake_with_an_arm_names_what_is_wrong(arm: vg.Arm, tmp_path: Path) -> None:
    with pytest.raises(ShapeError, match=r"q has shape \(3,\); it must have shape \(2,\)"):
        arm.jacobian([0, 0, 0])
    with pytest.raises(vg.InputError, match="a rotation and a translation"):
        arm.with_tip(2 * np.eye(4))
    with pytest.raises(vg.InputError, match="no such file"):
        vg.Arm.from_urdf(tmp_path / "none.urdf", tip="tool0")
    with pytest.raises(vg.InputError, match="did you mean tool0"):
        vg.Arm.from_urdf(tmp_path / "arm.urdf", tip="tool1")


def test_a_guard_takes_any_rates_and_keeps_every_limit(arm: vg.Arm) -> None:
    guard = vg.Guard(arm, [0.0, 0.1], period_s=0.002)
    for _ in range(3000):
        setpoint = guard.step([9.0, -9.0])
        assert (np.abs(setpoint.velocity) <= arm.rate_max).all()
        assert ((arm.q_min <= setpoint.position) & (setpoint.position <= arm.q_max)).all()
    np.testing.assert_allclose(setpoint.position, [2.0, 0.0], atol=1e-5)
    with pytest.raises(ShapeError, match=r"rates has shape \(1,\)"):
        guard.step([0.0])
    with pytest.raises(vg.InputError, match="period_s"):
        vg.Guard(arm, [0.0, 0.1], period_s=0)
    with pytest.raises(vg.InputError, match="finite joint positions"):
        vg.Guard(arm, [0.0, np.nan], period_s=0.002)
