"""Whatever is wrong with a cell is answered with file, key, what was given and what is allowed."""

import os
import shutil
import sys
from pathlib import Path

import pytest

from vergence.assembly import run_cell
from vergence.cell import built_in_cells, load_cell
from vergence.errors import InputError, RenderingError
from vergence.places import CELLS, find_cell
from vergence.simulation import choose_renderer
from vergence.simulation import renderer as renderer_module


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the Puma's cell that may be spoilt."""
    return Path(shutil.copytree(CELLS / "puma560", tmp_path / "cell"))


def spoil(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def complaint(folder: Path, **overrides: str) -> InputError:
    """What loading and starting the cell complains of; it must name the file."""
    keys = {key.replace("__", "."): value for key, value in overrides.items()}
    with pytest.raises(InputError) as caught:
        run_cell(load_cell(folder, keys), images=False)
    error = caught.value
    assert error.source == str((folder / "cell.toml").resolve())
    assert error.allowed
    assert str(error).startswith(f"{error.source}: ")
    return error


def test_the_cell_is_fine_until_it_is_spoilt(folder: Path) -> None:
    result = run_cell(load_cell(folder, {"duration_s": "0.1"}), images=False)
    assert result.outcome.succeeded


def test_a_model_that_is_not_there(folder: Path) -> None:
    for key, name in (
        ("arms.puma.model", "puma561.xml"),
        ("target.model", "boards.xml"),
        ("scene.model", "rooms.xml"),
    ):
        error = complaint(folder, **{key.replace(".", "__"): f'"{name}"'})
        assert error.key == key
        assert name in str(error.given)


def test_a_model_that_is_broken(folder: Path) -> None:
    for key, name in (("arms.puma.model", "puma560.xml"), ("target.model", "board.xml")):
        original = (folder / name).read_text()
        (folder / name).write_text(original[: len(original) // 2])
        error = complaint(folder)
        assert error.key == key
        assert name in str(error.given)
        (folder / name).write_text(original)


def test_a_model_that_reads_but_does_not_compile(folder: Path) -> None:
    spoil(folder / "board.xml", 'file="leaves.png"', 'file="branches.png"')
    error = complaint(folder)
    assert "branches.png" in str(error)


def test_joint_limits_the_wrong_way_round(folder: Path) -> None:
    spoil(folder / "puma560.xml", 'range="-160 160"', 'range="160 -160"')
    error = complaint(folder)
    assert error.key == "arms.puma.model"
    assert "joint1 160 … -160" in str(error.given)
    assert error.allowed == "lower below upper"


@pytest.mark.parametrize(
    ("key", "value", "suggestion"),
    [
        ("arms.puma.body", '"flang"', "did you mean flange"),
        ("cameras.wrist.body", '"link66"', "did you mean link"),
        ("cameras.wrist.arm", '"pumas"', "did you mean puma"),
        ("task.arm", '"pumas"', "did you mean puma"),
        ("task.camera", '"wrists"', "did you mean wrist"),
        ("law.kind", '"optimal_traking"', "optimal_tracking"),
        ("target.motion.kind", '"lines"', "line"),
    ],
)
def test_a_name_that_is_not_known(folder: Path, key: str, value: str, suggestion: str) -> None:
    error = complaint(folder, **{key.replace(".", "__"): value})
    assert error.key == key
    assert str(error.given) == value.strip('"')
    assert suggestion in error.allowed


@pytest.mark.parametrize(
    ("key", "suggestion"),
    [
        ("sede", "did you mean seed"),
        ("task.desire", "did you mean desired"),
        ("cameras.wrist.rate", "did you mean rate_hz"),
        ("arms.puma.start", "did you mean start_deg"),
        ("target.motion.speed_m_s", "allowed"),
        ("law.q", "allowed"),
    ],
)
def test_a_key_that_is_not_known(folder: Path, key: str, suggestion: str) -> None:
    error = complaint(folder, **{key.replace(".", "__"): "1"})
    assert error.key == key
    assert suggestion in str(error)


def test_a_start_outside_the_limits_names_the_joint_and_its_range(folder: Path) -> None:
    error = complaint(folder, arms__puma__start_deg="[-125.6, 42.7, 50.0, 0.0, -50.0, 0.0]")
    assert error.key == "arms.puma.start_deg[2]"
    assert error.given == 50.0
    assert error.allowed == "joint3 between -225 and 45"


@pytest.mark.parametrize("values", ["[]", "[1.0, 2.0]", "[0.0, 0, 0, 0, 0, 0, 0]"])
def test_a_start_with_the_wrong_number_of_values(folder: Path, values: str) -> None:
    error = complaint(folder, arms__puma__start_deg=values)
    assert error.key == "arms.puma.start_deg"
    assert "joint6" in error.allowed


@pytest.mark.parametrize("key", ["rate_max_deg_s", "acceleration_max_deg_s2"])
def test_as_many_rate_limits_as_joints(folder: Path, key: str) -> None:
    error = complaint(folder, **{f"arms__puma__{key}": "[100.0, 100.0]"})
    assert error.key == f"arms.puma.{key}"
    assert "6" in error.allowed


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("duration_s", "0"),
        ("duration_s", '"long"'),
        ("seed", "-1"),
        ("cameras.wrist.rate_hz", "0"),
        ("cameras.wrist.focal_mm", "-16.0"),
        ("cameras.wrist.latency_frames", "-1"),
        ("cameras.wrist.resolution", "[640]"),
        ("law.R", "0.0"),
        ("inner_rate_hz", "10"),
    ],
)
def test_a_value_that_makes_no_sense(folder: Path, key: str, value: str) -> None:
    error = complaint(folder, **{key.replace(".", "__"): value})
    assert error.key.startswith(key)


def test_a_key_of_another_kind_names_the_kind_it_stands_in(folder: Path) -> None:
    error = complaint(folder, target__motion='{ kind = "stationary", amplitude_m = 0.1 }')
    assert (error.key, error.given) == (
        "target.motion.amplitude_m",
        "a key that kind stationary does not have",
    )


def test_a_camera_with_two_lenses_or_none(folder: Path) -> None:
    error = complaint(folder, cameras__wrist__focal_px="[1000.0, 1000.0]")
    assert error.key == "cameras.wrist"
    assert "focal_mm" in error.allowed


def test_a_camera_that_does_not_see_the_target_at_the_start(folder: Path) -> None:
    features = "[[0.0, 0.0, 0.0]]"
    error = complaint(folder, target__position_m="[3.0, 3.0, 0.18]", target__features=features)
    assert error.key == "target"
    assert "camera wrist does not see feature 0, which is out of its image" in str(error.given)
    features = "[[0.0, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.0, 0.0]]"
    error = complaint(folder, target__position_m="[3.0, 3.0, 0.18]", target__features=features)
    assert "see features 0, 1 and 2, which are out of its image" in str(error.given)


def test_a_start_with_something_in_the_way_names_it(folder: Path) -> None:
    behind = {"cameras__wrist__position_m": "[0.0, 0.0, -0.3]"}
    error = complaint(folder, **behind, target__features="[[0.0, 0.0, 0.0]]")
    assert "camera wrist does not see feature 0; in the way: puma/" in str(error.given)
    error = complaint(folder, **behind)
    assert "does not fill the middle of camera wrist's image: it is " in str(error.given)


def test_desired_points_outside_the_image_or_too_few(folder: Path) -> None:
    error = complaint(folder, task__desired="[[900.0, 10.0]]")
    assert error.key == "task.desired"
    assert "640 x 480" in error.allowed
    error = complaint(folder, task__desired="[[100.0, 10.0], [50.0, 50.0]]")
    assert (error.given, error.allowed) == ("2 points", "1 points")


@pytest.mark.parametrize(
    ("key", "value", "place", "allowed"),
    [
        ("duration_s", "inf", "duration_s", "a finite number"),
        ("target.position_m", "[nan, 0, 0]", "target.position_m.0", "a finite number"),
        ("task", "[]", "task", "a table"),
        ("law", "3", "law", "a table"),
        ("laws.other", "{}", "laws.other.kind", "a value"),
        ("name", '"../elsewhere"', "name", "letters, digits"),
        ("name", f'"{"x" * 65}"', "name", "at most 64 characters"),
        ("law.axes", "[]", "law.axes", "at least 1 value"),
        ("law.R", "[1, -1]", "law.R.1", "greater than 0"),
        ("task.desired", "3", "task.desired", "centred, initial"),
        ("cameras.wrist.position_m", "3", "cameras.wrist.position_m", "a list"),
        ("cameras.wrist.distortion", "[1, 2, 3, 4, 5, 6]", "cameras.wrist.distortion", "at most 5"),
        ("cameras.wrist.blind_s", "[[2, 1]]", "cameras.wrist.blind_s", "from before to"),
        ("cameras.wrist.rate_hz", "501", "cameras.wrist.rate_hz", "up to inner_rate_hz, 500"),
        ("law.kind", "path_tracking", "law.kind", "image_based, optimal_tracking, point_pose"),
    ],
)
def test_a_value_that_cannot_be_used(
    folder: Path, key: str, value: str, place: str, allowed: str
) -> None:
    error = complaint(folder, **{key.replace(".", "__"): value})
    assert error.key == place
    assert allowed in error.allowed


def test_where_two_things_may_stand_the_nearer_mistake_is_told() -> None:
    with pytest.raises(InputError, match="position_m, rotation_rpy_deg") as caught:
        load_cell("four_cameras", {"task.desired": "{position = [1, 2, 3]}"})
    assert caught.value.key == "task.desired.position"


def test_a_camera_that_is_blind_at_the_start(folder: Path) -> None:
    error = complaint(folder, cameras__wrist__blind_s="[[0, 1]]")
    assert "cameras.wrist.blind_s" in str(error.given)


def test_avoidance_along_an_axis_that_is_not_controlled(folder: Path) -> None:
    error = complaint(folder, law__avoidance_axes='["z"]')
    assert (error.key, error.given) == ("law.avoidance_axes", "z")


def test_as_many_weights_as_axes(folder: Path) -> None:
    error = complaint(folder, law__R="[1.0, 2.0]")
    assert error.key == "law.R"
    assert "4" in error.allowed


def test_a_file_that_is_no_toml(folder: Path) -> None:
    (folder / "cell.toml").write_text("name = \n")
    error = complaint(folder)
    assert error.allowed == "a TOML file"
    assert "cell.toml: not TOML: Invalid value" in str(error)


def test_a_table_that_is_missing(folder: Path) -> None:
    text = (folder / "cell.toml").read_text()
    (folder / "cell.toml").write_text(text[: text.index("[task]")])
    error = complaint(folder)
    assert error.key == "task"
    assert "task: missing; needed: a value" in str(error)


def test_a_cell_that_does_not_exist_is_answered_with_those_that_do() -> None:
    with pytest.raises(InputError, match="did you mean puma560"):
        load_cell("puma56")
    assert "puma560" in built_in_cells()


def test_a_machine_without_a_renderer_is_told_the_package(monkeypatch) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.delitem(sys.modules, "mujoco", raising=False)
    monkeypatch.setattr(renderer_module, "find_library", lambda name: None)
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(RenderingError, match="libegl1"):
        choose_renderer()


def test_a_renderer_that_does_not_start_is_told_the_package(monkeypatch) -> None:
    import mujoco

    def broken(*_: object) -> None:
        raise RuntimeError("no display")

    monkeypatch.setattr(mujoco, "Renderer", broken)
    with pytest.raises(RenderingError, match=r"no display.*libegl1"):
        run_cell(load_cell("puma560", {"duration_s": "0.1"}))


@pytest.mark.parametrize(("present", "chosen"), [("EGL", "egl"), ("OSMesa", "osmesa")])
def test_egl_is_chosen_before_osmesa(monkeypatch, present: str, chosen: str) -> None:
    monkeypatch.setenv("MUJOCO_GL", "")
    monkeypatch.delenv("MUJOCO_GL")
    monkeypatch.delitem(sys.modules, "mujoco", raising=False)
    monkeypatch.setattr(
        renderer_module, "find_library", lambda name: name if name == present else None
    )
    choose_renderer()
    assert os.environ["MUJOCO_GL"] == chosen


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("empty", "given empty, a folder without cell.toml; "),
        ("my_cell.toml", "given my_cell.toml, which does not exist; "),
        ("puma56", "given puma56; "),
        ("", "missing; "),
    ],
)
def test_what_is_no_cell_is_named_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given: str, said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError) as caught:
        find_cell(given)
    assert str(caught.value).startswith(f"cell: {said}")
    assert "a cell file, or a built-in cell: cups, " in str(caught.value)
