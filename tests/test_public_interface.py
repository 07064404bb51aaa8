"""`import vergence as vg`: its names, how light it is, and what it says of mistakes."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import vergence as vg

STUB = Path(vg.__file__).with_suffix(".pyi")


def test_every_public_name_is_there_and_typed() -> None:
    typed = {
        alias.asname
        for node in ast.parse(STUB.read_text()).body
        for alias in getattr(node, "names", [])
    }
    assert typed == {*vg.__all__, "geometry"}
    for name in (*vg.__all__, "geometry"):
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
    lines = str(table).splitlines()
    assert lines[0].split()[0] == "law"
    assert [line.split()[0] for line in lines[2:]] == ["image_based", "constrained"]
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
    with pytest.raises(vg.ShapeError, match=r"points_px has shape \(2,\)"):
        camera.normalize([300, 180])
    with pytest.raises(vg.InputError, match="an array of numbers"):
        camera.normalize([["a", "b"]])
