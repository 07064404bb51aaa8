"""The command line answers in words or JSON, with the exit code that fits."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import made_up_run
import pytest
from typer.main import get_command

from vergence.app.main import app, main
from vergence.app.output import new_folder
from vergence.runtime.recording import Recording
from vergence.signals import OutcomeKind
from vergence.studies import Check, Figure, StudyResult

COMMANDS = [
    "run",
    "report",
    "reproduce",
    "plan",
    "new",
    "track",
    "compare",
    "map",
    "watch",
    "check",
    "bench",
    "cells",
]
QUICK_RUN = ["run", "puma560", "--no-images", "--set", "duration_s=0.5"]

Command = Callable[..., int]


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Run the command line in an empty folder; return its exit code."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def run(*arguments: str) -> int:
        monkeypatch.setattr(sys, "argv", ["vergence", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        code = end.value.code
        return code if isinstance(code, int) else 0

    return run


def test_python_runs_the_package_as_the_command_line() -> None:
    told = subprocess.run(
        [sys.executable, "-m", "vergence", "cells"], capture_output=True, text=True
    )
    assert told.returncode == 0
    assert "puma560" in told.stdout


def test_vergence_alone_says_what_to_do_next(command: Command, capsys: object) -> None:
    assert command() == 0
    assert "vergence run puma560" in capsys.readouterr().out


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_every_command_has_an_example(
    command: Command, capsys: object, name: str
) -> None:
    assert command(name, "--help") == 0
    assert f"Example: vergence {name}" in capsys.readouterr().out


def test_help_loads_nothing_heavy() -> None:
    script = "import sys, vergence.app.main; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    heavy = {"numpy", "numba", "cv2", "mujoco", "matplotlib", "scipy", "pydantic", "foxglove"}
    assert not heavy & set(done.stdout.split())


def test_a_run_leaves_recording_report_and_summary(command: Command, tmp_path: Path) -> None:
    assert command(*QUICK_RUN, "--out", "here") == 0
    files = {path.name for path in (tmp_path / "here").iterdir()}
    assert files == {"cell.toml", "recording.mcap", "report.html", "signals.csv", "summary.json"}
    assert Recording.open("here").outcome.kind is OutcomeKind.COMPLETED


def test_the_outcome_is_told_before_the_report_is_made(
    command: Command, capsys: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = []

    def write_report(folder: Path) -> Path:
        told.append(capsys.readouterr().out)
        return folder / "report.html"

    monkeypatch.setattr("vergence.app.report.write_report", write_report)
    assert command(*QUICK_RUN, "--out", "here") == 0
    assert "completed at 0.50 s" in told[0]
    assert "final error" in told[0]
    assert "report.html" not in told[0]
    assert "report.html" in capsys.readouterr().out


def test_json_is_one_object_and_nothing_else(command: Command, capsys: object) -> None:
    assert command(*QUICK_RUN, "--json", "--seed", "4") == 0
    written = capsys.readouterr()
    answer = json.loads(written.out, parse_constant=pytest.fail)
    assert set(answer) == {"command", "cell", "outcome", "summary", "run", "report"}
    assert (answer["command"], answer["cell"]) == ("run", "puma560")
    assert set(answer["outcome"]) == {"kind", "reason", "time"}
    assert Path(answer["report"]).is_file()
    assert Path(answer["run"]).parent == Path("runs")
    assert Recording.open(answer["run"]).info.seed == 4
    assert written.err == ""


def test_a_task_that_fails_exits_with_one(command: Command, capsys: object) -> None:
    fast = "target.motion.velocity_m_s=[6.0, 0.0, 0.0]"
    assert command("run", "puma560", "--no-images", "--set", "duration_s=8", "--set", fast) == 1
    assert "report" in capsys.readouterr().out


def test_an_arm_of_few_joints_says_what_it_cannot_do(command: Command, capsys: object) -> None:
    quick = ("--no-images", "--set", "duration_s=0.2", "--out", "here")
    assert command("run", "so100", *quick) == 0
    told = capsys.readouterr().out
    assert "With its 5 joints, arm so100 cannot move camera side in every direction: at the" in told
    assert "start it can move along x and turn about y only in combination" in told
    assert "unserved directions" in Path("here", "report.html").read_text()


BOARD = ["calibrate", ".", "--board", "9x6", "--square-mm", "25"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "puma56"], "did you mean puma560?"),
        (["run", "puma560", "--set", "durations_s=3"], "did you mean duration_s?"),
        (["run", "puma560", "--set", "duration_s"], "key=value"),
        (["report", "nowhere"], "recording.mcap"),
        (["reproduce", "nelson1996"], "did you mean nelson1995?"),
        (["reproduce", "defaults", "--imaging", "real_camera"], "only studies that render images"),
        (["reproduce", "region", "--imaging", "realcamera"], "did you mean real_camera?"),
        (["rnu"], "Did you mean 'run'?"),
        (["bench", "contrl"], "did you mean control?"),
        (["plan", "gantry", "--planner", "potential"], "did you mean potential_field?"),
        (["map", "puma560", "--over", "heading"], "did you mean headings?"),
        (["map", "puma560", "--extent", "0"], "--extent: given 0.0; allowed: from 0.001 to 500 m"),
        (["map", "puma560", "--extent", "1e6"], "--extent: given 1000000.0; allowed: from 0.0"),
        (["map", "puma560", "--extent", "1e-300"], "--extent: given 1e-300; allowed: from 0.001"),
        (["map", "puma560", "--speeds", "nan"], "--speeds: given nan; allowed: above 0 and up to"),
        (["map", "puma560", "--speeds", "0.1,1e300"], "--speeds: given 0.1,1e300; allowed: above"),
        (["map", "puma560", "--speeds", "1e-300"], "--speeds: given 1e-300; allowed: from 8e-06"),
        (["map", "puma560", "--speeds", "fast"], "--speeds: given fast; allowed: numbers"),
        (["calibrate", "--synthetic", "puma560", "--lens", "k1k3"], "did you mean k1k2?"),
        (["run", "puma560", "--set", "law.Q=abc"], "law.Q: given abc; allowed: a number"),
        (["run", "puma560", "--set", "law.Q=[-.03]"], "law.Q: given [-.03], which is not TOML: "),
        (["calibrate", "nowhere"], "nowhere: no such folder; needed: a folder of images"),
        ([*BOARD, "--marker-mm", "1e-300"], "--marker-mm"),
        ([*BOARD, "--square-mm", "inf"], "--square-mm"),
        ([*BOARD, "--camera", "c.yaml"], "c.yaml: no such file; needed: a camera in a file"),
        (["compare", "ur5", "--tolerance-px", "inf"], "--tolerance-px"),
        (["goal", "ur5", "--distance-m", "inf"], "--distance-m"),
        (["run", sys.executable], "not TOML"),
        (["goal", "ur5", "--out", "goal"], "--out: given goal; allowed: a file name that ends in"),
        (["run", "puma560", "--out", sys.executable], "which is a file; allowed: a folder"),
        (["new", "arm.urdf", "--out", sys.executable], "--out: given"),
        (["map", "puma560", "--out", sys.executable], "--out: given"),
        (["run", "puma560", "--out", "/proc/none"], "no such file or folder; needed: one that"),
        (["run", "ur5", "--goal", "."], "--goal: given .; allowed: an image file"),
        (
            ["run", "ur5", "--goal", sys.executable],
            "cannot be read as an image; allowed: a complete image file",
        ),
        (["run", "ur5", "--goal", "g.png"], "--goal: given g.png; allowed: an image file that"),
        (["run", "ur5", "--points", ""], "--points: given an empty text; allowed: pixels"),
        (["run", "ur5", "--points", "9,9 -5,-5"], "inside the image of 640 x 480"),
        (["reproduce", "honesty", "--imaging", "real"], "--imaging: given real; allowed"),
        (["watch", "ur5", "--host", ""], "--host: given an empty text; allowed: 127.0.0.1"),
        (["plan", "gantry", "--planner", "none"], "vergence plan: --planner: given none; "),
        (["check", "ur5"], "vergence check: --driver: missing; needed: one of franka, "),
    ],
)
def test_a_mistake_is_one_message_and_exit_code_two(
    command: Command, capsys: object, arguments: list[str], words: str
) -> None:
    assert command(*arguments) == 2
    written = capsys.readouterr()
    assert words in written.err
    assert "Traceback" not in written.err
    assert "vergence: vergence" not in written.err
    assert written.out == ""


@pytest.mark.parametrize("name", ["run", "watch"])
@pytest.mark.parametrize(
    ("driver", "words"),
    [
        ("ur", "ur:ADDRESS"),
        ("none", "--driver: given none; allowed: franka"),
        ("socket:localhost:99999", "given localhost:99999; allowed: HOST:PORT"),
        ("ros2:no/python", "given no/python, which does not run"),
        (f"ros2:{sys.executable}", "which has no rclpy"),
    ],
)
def test_a_driver_that_cannot_be_opened_is_told_before_the_rehearsal(
    command: Command,
    capsys: object,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    driver: str,
    words: str,
) -> None:
    monkeypatch.setattr("vergence.assembly.rehearse", lambda cell: pytest.fail("rehearsed"))
    assert command(name, "ur5", "--driver", driver) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "puma56"],
        ["run", "puma560", "--set", "durations_s=3"],
        ["plan", "gantry", "--planner", "none"],
        ["compare", "puma56"],
        ["map", "puma560", "--over", "heading"],
        ["report", "nowhere"],
        ["reproduce", "nelson1996"],
    ],
)
def test_a_mistake_is_told_before_anything_heavy_is_loaded(arguments: list[str]) -> None:
    script = (
        "import sys; from vergence.app.main import main\n"
        f"sys.argv = ['vergence', *{arguments}]\n"
        "try: main()\nexcept SystemExit: print(*sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert re.match("vergence( [a-z]+)?: ", done.stderr)
    assert not {"numba", "cv2", "mujoco", "matplotlib", "foxglove"} & set(done.stdout.split())


def test_a_folder_that_cannot_be_written_is_a_mistake(
    command: Command, capsys: object, tmp_path: Path
) -> None:
    (tmp_path / "taken").write_text("a file")
    assert command(*QUICK_RUN, "--out", "taken") == 2
    written = capsys.readouterr().err
    assert "taken" in written
    assert "Traceback" not in written


def test_a_recording_is_replaced_only_if_asked_and_is_not_taken_for_a_cell(
    command: Command, capsys: object, tmp_path: Path
) -> None:
    (tmp_path / "before").mkdir()
    (tmp_path / "before" / "recording.mcap").write_bytes(b"what was recorded")
    assert command(*QUICK_RUN, "--out", "before") == 2
    assert "which holds a recording; allowed: another folder, or --over" in capsys.readouterr().err
    assert (tmp_path / "before" / "recording.mcap").read_bytes() == b"what was recorded"
    assert command("run", "before") == 2
    assert "vergence watch before" in capsys.readouterr().err
    assert command(*QUICK_RUN, "--out", "before", "--overwrite") == 0
    assert Recording.open("before").complete


def test_an_interrupted_run_leaves_a_recording_and_says_where(
    command: Command, capsys: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    import vergence.assembly as assembly

    def interrupted(cell: object, listeners: object, images: bool) -> None:
        for listener in listeners:
            listener.begin(made_up_run.INFO)
        for record in made_up_run.ticks(1.0, images=False):
            for listener in listeners:
                listener.tick(record)
        raise KeyboardInterrupt

    monkeypatch.setattr(assembly, "run_cell", interrupted)
    assert command("run", "puma560", "--out", "cut") == 1
    assert "vergence report cut" in capsys.readouterr().err
    recording = Recording.open("cut")
    assert recording.outcome.kind is OutcomeKind.STOPPED
    assert recording.duration == pytest.approx(29 / 30)


def test_ctrl_c_ends_a_run_with_a_whole_recording(tmp_path: Path) -> None:
    run = subprocess.Popen(
        [sys.executable, "-m", "vergence.app.main", "run", "puma560", "--out", "cut"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    recording = tmp_path / "cut" / "recording.mcap"
    while run.poll() is None and not (recording.is_file() and recording.stat().st_size > 500_000):
        time.sleep(0.05)
    run.send_signal(signal.SIGINT)
    said, error = run.communicate(timeout=60)
    assert run.returncode == 1
    progress = re.compile(r"(prepare:|writing the report|puma560: [\d.]+ / 30\.0 s).*so far.*")
    assert all(progress.fullmatch(line) for line in error.splitlines()), error
    assert said.startswith("stopped at")
    assert "stopped by the user" in said
    kept = Recording.open(recording)
    assert kept.complete
    assert kept.outcome.kind is OutcomeKind.STOPPED
    assert (tmp_path / "cut" / "report.html").is_file()


def test_a_report_is_made_again(command: Command, capsys: object, run_folder: Path) -> None:
    assert command("report", str(run_folder), "--json") == 0
    assert json.loads(capsys.readouterr().out)["report"] == str(run_folder / "report.html")


def test_a_report_is_a_page_or_lies_in_a_folder(
    command: Command, capsys: object, run_folder: Path
) -> None:
    assert command("report", str(run_folder), "--out", "report.pdf") == 2
    assert "a file name that ends in .html, or a folder" in capsys.readouterr().err


def test_a_recording_sent_alone_has_a_report_under_its_name(
    command: Command, run_folder: Path
) -> None:
    Path("from-anna.mcap").write_bytes((run_folder / "recording.mcap").read_bytes())
    assert command("report", "from-anna.mcap") == 0
    assert "made-up" in Path("from-anna.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("other", [False, True])
def test_a_report_goes_where_out_says(
    command: Command, run_folder: Path, capsys: object, other: bool
) -> None:
    runs = [str(run_folder)] * (1 + other)
    assert command("report", *runs, "--out", "deep/mine.html") == 0
    assert "made-up" in Path("deep/mine.html").read_text(encoding="utf-8")
    assert list(Path("deep").glob("mine-*.csv"))
    assert command("report", *runs, "--out", "folder", "--json") == 0
    page = Path(json.loads(capsys.readouterr().out.splitlines()[-1])["report"])
    assert page.parent == Path("folder")
    assert page.is_file()


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("run pum", ["puma560"]),
        ("reproduce mez", ["mezouar2001"]),
        ("compare panda --laws own,opt", ["own,optimal_tracking"]),
        ("plan gantry --planner p", ["potential_field"]),
        ("map puma560 --over h", ["headings"]),
        ("report runs/", ["runs/mine-1"]),
        ("bench loo", ["loop"]),
    ],
)
def test_tab_completes(tmp_path: Path, line: str, expected: list[str]) -> None:
    (tmp_path / "runs" / "mine-1").mkdir(parents=True)
    (tmp_path / "runs" / "mine-1" / "recording.mcap").touch()
    words = f"vergence {line}"
    asked = {"_VERGENCE_COMPLETE": "complete_bash", "COMP_WORDS": words}
    place = {"COMP_CWORD": str(len(words.split()) - 1)}
    program = "import sys; sys.argv[0] = 'vergence'; from vergence.app.main import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env=os.environ | asked | place,
        capture_output=True,
        text=True,
    )
    assert done.stdout.split() == expected


def test_built_in_cells_are_listed(command: Command, capsys: object) -> None:
    assert command("cells", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert "puma560" in told["cells"]
    assert all(told["descriptions"][name].endswith(".") for name in told["cells"])
    assert command("cells") == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == told["cells"]


@pytest.fixture(params=[True, False])
def holds(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    """A study in the place of the paper's whose one check holds or not."""

    def reproduce(
        out: Path, quick: bool, progress: Callable[[str, float], None], seed: int
    ) -> StudyResult:
        progress("half", 0.5)
        path = out / "drift.svg"
        path.write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
        check = Check("drift_px", "at most 1", 0.25, "px", request.param, "over <all> of it")
        return StudyResult("A paper", (check,), (Figure(path, "How it drifts."),))

    study = ModuleType("nelson1995")
    study.reproduce = reproduce
    monkeypatch.setitem(sys.modules, "vergence.studies.nelson1995", study)
    return request.param


def test_a_studys_checks_decide_the_exit_code(
    command: Command, capsys: object, holds: bool
) -> None:
    assert command("reproduce", "nelson1995", "--json", "--quick", "--out", "study") == 1 - holds
    answer = json.loads(capsys.readouterr().out)
    assert (answer["command"], answer["paper"], answer["quick"]) == (
        "reproduce",
        "nelson1995",
        True,
    )
    [check] = answer["checks"]
    assert list(check) == [
        *("name", "paper", "bound", "measured", "unit", "holds", "note", "others", "spread"),
    ]
    assert check["holds"] is holds
    assert check["spread"] is None
    page = Path(answer["report"]).read_text(encoding="utf-8")
    assert "How it drifts." in page
    assert "over &lt;all&gt; of it" in page
    assert "quick" in page


def test_several_seeds_tell_with_how_many_a_check_holds(
    command: Command, capsys: object, holds: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: {0})
    options = ("--seeds", "3", "--out", "study")
    assert command("reproduce", "nelson1995", *options, "--json") == 1 - holds
    answer = json.loads(capsys.readouterr().out)
    assert (answer["seed"], answer["seeds"]) == (0, 3)
    [check] = answer["checks"]
    held = 3 if holds else 0
    assert check["spread"] == {"seeds": 3, "held": held, "median": 0.25, "low": 0.25, "high": 0.25}
    page = Path(answer["report"]).read_text(encoding="utf-8")
    assert f"{held} of 3</span>" in page
    assert "seeds 0 to 2" in page
    assert command("reproduce", "nelson1995", *options) == 1 - holds
    assert f"{held} of 3" in capsys.readouterr().out


def test_run_folders_never_collide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    folders = []
    for _ in range(3):
        folders.append(new_folder("cell"))
        folders[-1].mkdir(parents=True)
    assert len(set(folders)) == 3


def test_the_help_of_every_option_is_a_sentence_of_its_own() -> None:
    for name, one in get_command(app).commands.items():
        for option in one.params:
            text = option.help or ""
            assert text, f"{name} {option.name} says nothing"
            assert text[0].isupper(), f"{name} {option.name}: {text}"
            assert text.endswith("."), f"{name} {option.name}: {text}"
            assert not text.startswith(("Of ", "As ")), f"{name} {option.name}: {text}"
