"""One declaration per part: constructor, cell table and messages agree; a user's own are found."""

import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from vergence import registry
from vergence.assembly import open_driver, run_cell
from vergence.cell import load_cell
from vergence.control import ServoSettings
from vergence.errors import InputError
from vergence.experiments import law_table
from vergence.loading import Place
from vergence.parts import field_names, table_of
from vergence.places import CELLS

MINE = (Path(__file__).parents[1] / "examples" / "mine.py").read_text()
SQUARE = "features = [[0.05, 0.05, 0], [-0.05, 0.05, 0], [-0.05, -0.05, 0], [0.05, -0.05, 0]]"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A cell beside which a user's own objective lies."""
    puma = CELLS / "puma560"
    for file in puma.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    text = (puma / "cell.toml").read_text()
    head, _, _ = text.partition("\n[law]")
    head = head.replace("[target]\n", f"[target]\n{SQUARE}\n")
    (tmp_path / "cell.toml").write_text(head + '\n[law]\nkind = "mine:Centre"\ngain = 2.0\n')
    (tmp_path / "mine.py").write_text(MINE)
    return tmp_path


def place(folder: Path) -> Place:
    return Place("cell.toml", "law", folder)


def test_an_objective_beside_the_cell_runs_and_is_compared(folder: Path) -> None:
    settings = {"duration_s": "2", "target.motion": '{ kind = "stationary" }'}
    cell = load_cell(folder, settings | {"task.desired": '"centred"'})
    assert cell.law.objective.gain == 2.0
    assert cell.law.kind == "mine:Centre"
    assert cell.replace(duration_s=1.0).law.kind == "mine:Centre"
    assert run_cell(cell, images=False).outcome.succeeded
    table = law_table(load_cell(folder, {"law": "{ kind = 'image_based' }"}), "mine:Centre")
    assert table["kind"] == "mine:Centre"
    assert load_cell(folder, {"law.gain": "3"}).law.objective.gain == 3.0


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("law.gain", "30", "law.gain: given 30; allowed: at most 20"),
        ("law.gian", "1", "did you mean gain?"),
        ("law.kind", "mine:Center", "mine has no Center; its parts: Centre (did you mean Centre?)"),
        ("law.kind", "nowhere:Centre", "but no nowhere.py is in "),
        (
            "law.kind",
            "mine:Center",
            'a class declared with @vg.objective or declared with @vg.part("law")',
        ),
        ("law.kind", "lacking:Law", "has no method bind; allowed: a class with the method bind"),
        ("law.kind", "mine:vg", "is not a class"),
        ("law.kind", "pathlib:Path", "declared as nothing"),
        ("law.solver", "mine:Centre", "declared as objective"),
        ("law.kind", "broken:X", "raised ZeroDivisionError"),
        ("law.kind", "empty:X", "no method quadratic"),
        ("law.kind", "raising:X", "constructor raised RuntimeError: no luck"),
    ],
)
def test_a_part_that_cannot_be_used_is_named_with_key_and_reason(
    folder: Path, key: str, value: str, said: str
) -> None:
    (folder / "broken.py").write_text("1 / 0")
    (folder / "lacking.py").write_text(
        "from vergence.parts import part\n@part('law')\nclass Law:\n    gain: float = 1.0\n"
    )
    declared = "from vergence.parts import part\n@part('objective')\nclass X:\n"
    (folder / "empty.py").write_text(f"{declared}    gain: float = 1.0\n")
    (folder / "raising.py").write_text(
        f"{declared}    gain: float = 1.0\n"
        "    def __post_init__(self):\n        raise RuntimeError('no luck')\n"
        "    def quadratic(self, state):\n        ...\n"
    )
    with pytest.raises(InputError) as caught:
        load_cell(folder, {key: value})
    assert said in str(caught.value)
    assert caught.value.source == str(folder / "cell.toml")


def test_two_cells_may_each_have_a_module_of_the_same_name(folder: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    (other / "mine.py").write_text(MINE.replace("1.0,", "7.0,"))
    here, there = (registry.find("objective", "mine:Centre", folder=f) for f in (folder, other))
    assert (here().gain, there().gain) == (1.0, 7.0)
    assert "mine" not in sys.modules


def test_an_installed_package_offers_parts_by_entry_points(monkeypatch) -> None:
    point = EntryPoint("objective.straight", "vergence.control:PointPose", registry.ENTRY_POINTS)
    monkeypatch.setattr(registry, "entry_points", lambda group: [point])
    assert "straight" in registry.kinds("objective")
    assert "straight" not in registry.kinds("solver")
    settings = ServoSettings.from_table({"kind": "straight"}, Place("cell.toml", "law", None))
    assert type(settings.objective).__name__ == "PointPose"


def test_the_entry_points_are_read_once(monkeypatch) -> None:
    reads: list[str] = []

    def read(group: str) -> list[EntryPoint]:
        reads.append(group)
        return []

    monkeypatch.setattr(registry, "entry_points", read)
    for role in ("objective", "solver", "objective"):
        registry.kinds(role)
    assert reads == [registry.ENTRY_POINTS]


@pytest.mark.parametrize("role", [role for role, parts in registry.BUILT_IN.items() if parts])
def test_every_part_that_ships_is_there_and_of_its_role(role: str) -> None:
    for kind in registry.BUILT_IN[role]:
        assert role in registry.find(role, kind).__part_roles__


@pytest.mark.parametrize("role", ["objective", "solver", "limits"])
def test_python_and_tables_have_the_same_defaults(role: str) -> None:
    for kind in registry.BUILT_IN[role]:
        cls = registry.find(role, kind)
        table = table_of(cls())
        assert table.pop("kind") == kind
        assert table.keys() <= set(field_names(cls))


def test_settings_are_written_as_they_are_read() -> None:
    for cell in ("puma560", "wrist_and_wall", "panda"):
        law = load_cell(cell).law
        for defaults in (False, True):
            again = ServoSettings.from_table(law.table(defaults=defaults), Place("", "law", None))
            assert again == law


ROBOT = (Path(__file__).parents[1] / "examples" / "my_robot.py").read_text()


def test_a_cell_runs_with_a_driver_of_ones_own(folder: Path, capsys, monkeypatch) -> None:
    from vergence.app.options import RunOptions
    from vergence.app.run import run

    (folder / "my_robot.py").write_text(ROBOT)
    monkeypatch.chdir(folder)
    settings = ["law={ kind = 'image_based' }", "duration_s=0.3"]
    options = RunOptions(
        cell="cell.toml", out=folder / "out", settings=settings, driver="my_robot:MyRobot:x"
    )
    assert run(options) == 0
    assert "completed at 0.30 s" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("named", "said"),
    [
        ("nowhere:Robot", "but no nowhere.py is in "),
        ("no_such_robot", "module:Class"),
        ("mine:Centre", "as objective; allowed: a class that inherits from vg.Driver"),
        ("broken_robot:MyRobot", "which raised OSError: no robot answers"),
    ],
)
def test_a_driver_that_cannot_be_opened_is_told_in_a_sentence(
    folder: Path, named: str, said: str
) -> None:
    broken = ROBOT.replace("self._controller = ", "raise OSError('no robot answers')  # ")
    (folder / "broken_robot.py").write_text(broken)
    with pytest.raises(InputError) as caught:
        open_driver(load_cell(folder), named)
    assert said in str(caught.value)
    assert caught.value.source == "--driver"
