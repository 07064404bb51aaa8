"""A cell with one target, and with several by name."""

from pathlib import Path
from typing import Any

import pytest

from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.errors import InputError, KeyConflict
from vergence.places import CELLS


def written(folder: Path, old: str, new: str) -> Path:
    """The cell with two blocks, changed, in a folder of its own."""
    text = (CELLS / "two_blocks/cell.toml").read_text().replace('"../', f'"{CELLS}/')
    text = text.replace('"wedge.xml"', f'"{CELLS}/two_blocks/wedge.xml"')
    assert old in text
    path = folder / "cell.toml"
    path.write_text(text.replace(old, new))
    return path


def complaint(path: Path, **overrides: str) -> InputError:
    with pytest.raises(InputError) as caught:
        load_cell(path, overrides)
    return caught.value


def test_a_target_without_a_name_is_the_only_one() -> None:
    cell = load_cell("puma560")
    assert list(cell.targets) == ["target"]
    assert cell.target is cell.targets["target"]


def test_the_task_says_which_of_several_it_is_about() -> None:
    cell = load_cell("two_blocks", {"task.target": "wedge"})
    assert list(cell.targets) == ["block", "wedge"]
    assert cell.target is cell.targets["wedge"]
    assert cell.about("block").target is cell.targets["block"]


def test_every_task_may_be_about_another(tmp_path: Path) -> None:
    task = 'kind = "follow"\narm = "follower"\ncamera = "hand"\n'
    until = 'until = { kind = "time", time_s = 1.0 }\n'
    tasks = f'[[tasks]]\ntarget = "wedge"\n{task}{until}\n[[tasks]]\ntarget = "block"\n{task}'
    old = f'[task]\nkind = "follow"\ntarget = "block"\n{task.partition(chr(10))[2]}'
    cell = load_cell(written(tmp_path, old, tasks))
    assert [stage.target_name for stage in cell.stages] == ["wedge", "block"]
    path = written(tmp_path, old, tasks.replace('target = "block"', 'target = "blick"'))
    error = complaint(path)
    assert (error.key, error.given) == ("tasks.1.target", "blick")
    assert "did you mean block?" in error.allowed


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ('target = "block"\n', "", "task.target", "block, wedge"),
        ('target = "block"\n', 'target = "blok"\n', "task.target", "did you mean block?"),
        ("[targets.wedge]", "[target]", "target", "cannot be combined with targets"),
        ("targets.wedge", "targets.target", "targets.target", "or another name"),
        ("position_m = [1.17", "place_m = [1.17", "targets.wedge.place_m", "position_m"),
        ("wedge.xml", "ledge.xml", "targets.wedge.model", "exists"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, old: str, new: str, key: str, words: str) -> None:
    path = written(tmp_path, old, new)
    with pytest.raises(InputError) as caught:
        run_cell(load_cell(path), images=False)
    assert caught.value.key == key
    assert words in str(caught.value)


def test_what_is_wrong_with_the_only_target_is_named_without_a_name() -> None:
    assert complaint(CELLS / "puma560", **{"target.place_m": "[0, 0, 0]"}).key == "target.place_m"
    nobody = {"target.carried_by": "nobody", "target.motion": "stationary"}
    assert complaint(CELLS / "puma560", **nobody).key == "target.carried_by"
    assert complaint(CELLS / "puma560", tarket="1").allowed.endswith("(did you mean target?)")
    assert complaint(CELLS / "puma560", target="").key == "target"
    both = complaint(CELLS / "puma560", **{"targets.block.model": "block.xml"})
    assert isinstance(both, KeyConflict)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("puma560", {"target": {"position_m": (0.1, 0.2, 0.3)}}),
        ("two_blocks", {"target": {"position_m": (0.1, 0.2, 0.3)}}),
        ("two_blocks", {"targets": {"wedge": {"position_m": (0.1, 0.2, 0.3)}}}),
    ],
)
def test_a_changed_target_is_read_back_from_the_text(name: str, changes: dict[str, Any]) -> None:
    cell = load_cell(name).replace(**changes)
    settings = [line[7:].partition(" = ") for line in cell.text.splitlines() if "# set:" in line]
    again = load_cell(name, {key: value for key, _, value in settings})
    assert again.targets == cell.targets
    moved = [n for n, t in cell.targets.items() if t.position_m == (0.1, 0.2, 0.3)]
    assert moved == [next(iter(changes.get("targets", {cell.target_name: {}})))]


def test_a_task_looks_for_the_tag_of_its_own_target() -> None:
    tag = '{ dictionary = "aruco_4x4_50", id = 3, size_m = 0.05 }'
    task = '{ kind = "track", arm = "follower", camera = "hand", target = "wedge" }'
    cell = load_cell("two_blocks", {"targets.wedge.tag": tag, "task": task})
    assert type(cell.task.tracker).__name__ == "TagTracking"
    other = load_cell("two_blocks", {"targets.block.tag": tag, "task": task})
    assert type(other.task.tracker).__name__ != "TagTracking"
