"""A user's own part that fails in the middle of a run ends it with a name, a file and a line."""

import re
import shutil
import sys
from pathlib import Path

import pytest

from vergence.app.main import main
from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.experiments import compare
from vergence.experiments.trial import Ending
from vergence.places import CELLS
from vergence.signals import OutcomeKind

PARTS = Path(__file__).with_name("late_parts.py")
WHERE = r"late_parts\.py:\d+"
FEATURES = {
    "Raises": rf"^the law raised ValueError: my corner \(.*{WHERE}\)$",
    "Short": rf"Short: interaction \(.*{WHERE}\) returned an array of shape \(7, 6\)",
    "NotFinite": rf"NotFinite: interaction \(.*{WHERE}\) returned numbers that are not finite",
    "NoValue": rf"NoValue: value \(.*{WHERE}\) returned NoneType; needed: an array of numbers",
}
OBJECTIVES = {
    "ObjectiveRaises": rf"^the law raised KeyError: 'mine' \(.*{WHERE}\)$",
    "ObjectiveNothing": rf"quadratic \(.*{WHERE}\) returned NoneType; needed: a Quadratic",
    "ObjectiveSmall": rf"quadratic \(.*{WHERE}\) returned an array of shape \(3, 3\)",
    "ObjectiveNotFinite": rf"quadratic \(.*{WHERE}\) returned numbers that are not finite",
}
LIMITS = {
    "LimitRaises": rf"^the law raised IndexError: mine \(.*{WHERE}\)$",
    "LimitNothing": rf"rows \(.*{WHERE}\) returned NoneType; needed: C and d",
    "LimitNarrow": rf"rows \(.*{WHERE}\) returned an array of shape \(1, \d\)",
    "LimitOfTwoRows": rf"rows \(.*{WHERE}\) returned an array of shape \(1,\); needed: shape \(2",
    "LimitNotFinite": rf"rows \(.*{WHERE}\) returned numbers that are not finite",
}
MOTIONS = {
    "MotionRaises": rf"^the driver raised ArithmeticError: my path \(.*{WHERE}\)$",
    "MotionFlat": rf"poses \(.*{WHERE}\) returned an array of shape \(\d+, 3, 4\)",
    "MotionNotFinite": rf"poses \(.*{WHERE}\) returned numbers that are not finite",
}
KEYS = {
    **{name: f'law.feature="late_parts:{name}"' for name in FEATURES},
    **{name: f'law={{ kind = "late_parts:{name}" }}' for name in OBJECTIVES},
    **{name: f'law.limits.own=["late_parts:{name}"]' for name in LIMITS},
    **{name: f'target.motion="late_parts:{name}"' for name in MOTIONS},
}
REASONS = {**FEATURES, **OBJECTIVES, **LIMITS, **MOTIONS}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the cells, and beside that of the Panda the parts."""
    shutil.copytree(CELLS, tmp_path, dirs_exist_ok=True)
    shutil.copy(PARTS, tmp_path / "panda")
    return tmp_path


def settings(name: str) -> dict[str, str]:
    key, _, value = KEYS[name].partition("=")
    square = "[[0.06, 0.06, 0.0], [-0.06, 0.06, 0.0], [-0.06, -0.06, 0.0], [0.06, -0.06, 0.0]]"
    law = {} if key.startswith("law") and "kind" in value else {"law": '{ kind = "image_based" }'}
    still = {} if key == "target.motion" else {"target.motion": '{ kind = "stationary" }'}
    return {**law, **still, "target.features": square, "duration_s": "8", key: value}


@pytest.mark.parametrize("name", KEYS)
def test_a_part_that_fails_in_a_run_is_named_with_its_file_and_line(
    folder: Path, name: str
) -> None:
    run = run_cell(load_cell(folder / "panda", settings(name)), images=False)
    assert run.outcome.kind is OutcomeKind.PART_RAISED
    assert run.outcome.time > 0.1
    assert re.search(REASONS[name], run.outcome.reason), run.outcome.reason


@pytest.mark.parametrize("name", [*FEATURES, *MOTIONS])
def test_a_part_that_fails_at_the_start_is_refused_with_its_key(folder: Path, name: str) -> None:
    text = (
        PARTS.read_text().replace("FROM = 200", "FROM = 0").replace("MOVES_S = 0.6", "MOVES_S = -1")
    )
    (folder / "panda" / "late_parts.py").write_text(text)
    with pytest.raises(InputError) as said:
        run_cell(load_cell(folder / "panda", settings(name)), images=False)
    assert said.value.key == ("law.feature" if name in FEATURES else "target.motion")
    assert re.search(rf"late_parts:{name}.*{WHERE}", str(said.value))


def test_the_terminal_shows_no_traceback_and_names_the_file_that_has_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder / "panda")
    changes = {"task.tracker": '"late_parts:Tracker"', "duration_s": "8"}
    given = [word for key, value in changes.items() for word in ("--set", f"{key}={value}")]
    monkeypatch.setattr(sys, "argv", ["vergence", "run", "cell.toml", "--out", "mine", *given])
    with pytest.raises(SystemExit) as end:
        main()
    out, err = capfd.readouterr()
    assert end.value.code == 1
    assert re.search(r"^part raised at .*the perception raised RuntimeError: my lens cap", out)
    assert "Traceback" not in out + err
    assert f"traceback  {Path('mine') / 'traceback.txt'}" in out
    assert "my lens cap" in (folder / "panda" / "mine" / "traceback.txt").read_text()


def test_a_comparison_goes_on_after_a_run_in_which_a_part_raised(folder: Path) -> None:
    cell = load_cell(folder / "panda", settings("Raises"))
    (result,) = compare(cell, ["own"], starts=1, spread=0.05, duration_s=8).runs
    assert result.ending is Ending.OTHER
    assert re.search(REASONS["Raises"].strip("^$"), result.reason)
