"""The command line.

Commands import what they need when they run, so that help comes at once.
"""

import gc
import re
import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from vergence.app import names
from vergence.app.options import (
    CalibrateOptions,
    CheckOptions,
    CompareOptions,
    GoalOptions,
    Json,
    MapOptions,
    NewOptions,
    Out,
    PlanOptions,
    RunOptions,
    TrackOptions,
    WatchOptions,
    as_typed,
    folder_to_write,
    takes,
)
from vergence.app.output import BAD_INPUT, SUCCESS, emit, say, warn
from vergence.app.warnings_once import warn_once
from vergence.errors import Absent, InputError, VergenceError
from vergence.kernels.prebuilt import use_prebuilt_kernels
from vergence.places import cell_description, find_cell, find_recording, is_track
from vergence.studies import PAPERS

app = typer.Typer(
    name="vergence",
    help="Visual servoing that keeps the target in view and the arm clear of its limits.",
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)

_NEXT = """vergence controls robot arms with their cameras.

  vergence run puma560                    an arm follows a moving board; writes a report
  vergence watch puma560                  the same, live in your browser
  vergence run puma560 --no-images        without images, much faster
  vergence cells                          list the built-in cells
  vergence new ARM.urdf --body LAST_LINK  write a first cell for your own arm
  vergence compare panda                  several laws from the same random starts
  vergence reproduce nelson1995 --quick   a paper's experiments, checked

  vergence --help                         all commands; each has --help with an example
  vergence --install-completion           complete names with Tab
"""

_FILES = (
    (IsADirectoryError, "a folder", "a file"),
    ((FileExistsError, NotADirectoryError), "a file", "a folder"),
    (FileNotFoundError, Absent("no such file or folder"), "one that exists"),
    (PermissionError, "a path without permission", "one that you may read and write"),
)


def main() -> None:
    """Run the command line; a mistake of the user is one message and exit code 2."""
    # What is loaded stays. Looking through it for garbage again and again, as Python does by
    # default, takes a tenth of the time to the end of a short run.
    gc.set_threshold(50_000, 20, 100)
    warn_once()
    try:
        app()
    except VergenceError as error:
        _complain(str(error))
    except OSError as error:  # such as a folder that cannot be written
        _complain(_of_files(error))


def _complain(told: str) -> NoReturn:
    """Say what is wrong with the input, and end."""
    warn(told if told.startswith("vergence ") else f"vergence: {told}")
    sys.exit(BAD_INPUT)


def _of_files(error: OSError) -> str:
    """Return what the system says of a file, in the words of our own messages."""
    if not error.filename:
        return str(error)
    for kinds, given, allowed in _FILES:
        if isinstance(error, kinds):
            return str(InputError(str(error.filename), "", given, allowed))
    return f"{error.filename}: {error.strerror}"


@app.callback(invoke_without_command=True)
def start(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    """Visual servoing that keeps the target in view and the arm clear of its limits."""
    if version:
        from importlib.metadata import version as version_of

        say(version_of("vergence"))
        raise typer.Exit(SUCCESS)
    if context.invoked_subcommand is None:
        say(_NEXT.rstrip())
    elif reason := use_prebuilt_kernels():
        warn(f"vergence: {reason}. They are compiled on first use, which takes a minute or two.")


@app.command(epilog="Example: vergence run puma560 --seed 4 --set duration_s=10")
@takes(RunOptions)
def run(options: RunOptions) -> int:
    """Run a work cell: print a summary, and write a folder with a recording and a report."""
    from vergence.app.run import run as command

    return command(options)


@app.command(
    epilog="Example: vergence report runs/puma560-20250131-120000    or vergence report RUN OTHER"
)
def report(
    run: Annotated[
        Path,
        typer.Argument(
            help="A run folder or a recording, which may be incomplete; or the folder of a track.",
            autocompletion=names.reported,
        ),
    ],
    other: Annotated[
        Path | None,
        typer.Argument(
            help="A second run, to compare with the first.", autocompletion=names.recordings
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Page to write (.html), or a folder for it. Default: the run's folder."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Write a report again: of a recording, of tracked footage, or of two recordings compared."""
    if is_track(run):
        path = _track_report(run, other, out)
    elif other is None:
        find_recording(run)
        from vergence.app.report import page_at, write_report

        path = write_report(run, page_at(out))
    else:
        from vergence.app.report_pair import write_pair

        find_recording(run)
        path = write_pair(run, other, out)
    if as_json:
        folder = run if is_track(run) else find_recording(run).parent
        emit({"command": "report", "run": folder, "report": path})
    else:
        say(f"report  {path}")


def _track_report(folder: Path, other: Path | None, out: Path | None) -> Path:
    """Write the report of tracked footage again; return where it is."""
    from vergence.app.report import page_at
    from vergence.app.tracking.track_page import write_track_page

    if other is not None:
        given = f"{folder}, which holds tracked footage"
        raise InputError(
            "vergence report", "", given, "two recordings of runs to compare, or one folder"
        )
    return write_track_page(folder, page_at(out))


@app.command(epilog="Example: vergence export runs/puma560-20250131-120000 --out puma560-bag")
def export(
    run: Annotated[
        Path,
        typer.Argument(help="A run folder, or its recording.", autocompletion=names.recordings),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the bag. Default: bag, beside the recording.", callback=folder_to_write
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Write a recording as a ROS 2 bag: images, camera parameters, joints, set-points, poses."""
    file = find_recording(run)
    from vergence.runtime.bags import write_bag
    from vergence.runtime.recording import Recording

    bag = out or file.parent / "bag"
    count = write_bag(Recording.open(file), bag)
    if as_json:
        emit({"command": "export", "run": file.parent, "bag": bag, "messages": count})
    else:
        say(f"bag  {bag}  ({count} messages)")


@app.command(epilog="Example: vergence plan gantry --planner potential_field")
@takes(PlanOptions)
def plan(options: PlanOptions) -> int:
    """Plan the path between two images and draw it; nothing moves."""
    from vergence.app.plan import plan as command

    return command(options)


@app.command(epilog="Example: vergence reproduce nelson1995 --quick")
def reproduce(
    paper: Annotated[
        str,
        typer.Argument(
            help=f"Name of the study: {', '.join(PAPERS)}.", autocompletion=names.papers
        ),
    ],
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="Fewer runs, and exact projections instead of images: a few minutes at most.",
        ),
    ] = False,
    seed: Annotated[int, typer.Option(help="Random seed.", min=0)] = 0,
    seeds: Annotated[
        int,
        typer.Option(
            help="Number of seeds, counted from --seed; each check says with how many it holds.",
            min=1,
            max=1000,
        ),
    ] = 1,
    imaging: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Imaging of all simulated cameras, such as real_camera. Default: the cells' own.",
        ),
    ] = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Repeat a paper's experiments, with figures and a table of its claims and our results."""
    from vergence.app.reproduce import reproduce as command

    with as_typed({"imaging": "--imaging"}):
        raise typer.Exit(command(paper, quick, seed, seeds, imaging, out, as_json))


@app.command(
    epilog="Example: vergence track footage/ --model box.obj --fx 548 --start 0.02,0.1,0.5,0,180,0"
    "    or vergence track footage/ --curve ellipse:160,120"
)
@takes(TrackOptions)
def track(options: TrackOptions) -> int:
    """Track an object, a tag or curves in recorded images: values, covariances, an overlay film."""
    from vergence.app.track import track as command

    return command(options)


@app.command(epilog="Example: vergence new my_robot.urdf --body tool0")
@takes(NewOptions)
def new(options: NewOptions) -> int:
    """Write a first cell for your own arm, with a suitable start, camera and target."""
    from vergence.app.new import new as command

    return command(options)


@app.command(epilog="Example: vergence watch puma560    or vergence watch runs/NAME-TIME")
@takes(WatchOptions)
def watch(options: WatchOptions) -> int:
    """Show a running cell or a recording in the browser: change settings, drag the target."""
    from vergence.app.watch import watch as command

    return command(options)


@app.command(
    epilog="Example: vergence compare panda --laws image_based,constrained --tolerance-px 5"
)
@takes(CompareOptions)
def compare(options: CompareOptions) -> int:
    """Run several laws from the same random starts, and show where each of them fails."""
    find_cell(options.cell)  # report mistakes before loading everything
    from vergence.app.compare import compare as command

    return command(options)


@app.command(name="map", epilog="Example: vergence map puma560 --over headings --speeds 0.1,0.2")
@takes(MapOptions)
def map_region(options: MapOptions) -> int:
    """Map where a cell's law works: how far it follows the target, and how it fails."""
    find_cell(options.cell)  # report mistakes before loading everything
    from vergence.app.map_region import map_region as command

    return command(options)


@app.command(
    epilog="Example: vergence calibrate photos/ --board 11x8 --square-mm 20 --marker-mm 15"
)
@takes(CalibrateOptions)
def calibrate(options: CalibrateOptions) -> int:
    """Estimate a camera's lens and mounting from images of a board.

    Images alone determine the lens. With the arm's pose for each image, lens and mounting are
    refined together. With --driver and --cell, images and poses are taken from a robot that you
    move from stop to stop. With --latency, an arm swings one joint by 2° and the delay of the
    camera's images is measured. With --mounting, the robot reports where its cameras are.
    """
    if options.mounting is not None and options.latency is not None:
        raise InputError(
            "vergence calibrate", "--mounting", options.mounting, "only without --latency"
        )
    if options.latency is not None:
        from vergence.app.latency import latency as measure

        return measure(options)
    if options.mounting is not None:
        from vergence.app.mounting import mounting

        return mounting(options)
    if options.write:
        allowed = "only together with --latency CELL or --mounting CELL"
        raise InputError("vergence calibrate", "--write", True, allowed)
    if options.settings and not options.driver:
        raise InputError(
            "vergence calibrate", "--set", options.settings, "only together with --driver NAME"
        )
    from vergence.app.calibrate import calibrate as command

    return command(options)


@app.command(epilog="Example: vergence check my_cell.toml --driver ur:192.168.1.10")
@takes(CheckOptions)
def check(options: CheckOptions) -> int:
    """Check a real robot before its first run: clocks and images, then a move of each joint.

    The arm moves at a tenth of its limits, and only after all checks at rest have passed.
    """
    from vergence.app.bring_up import check as command

    return command(options)


@app.command(epilog="Example: vergence goal ur5 --at 0,-100,100,-90,-90,30 --out goal.png")
@takes(GoalOptions)
def goal(options: GoalOptions) -> int:
    """Take a photograph as a goal: an image, with its camera file and the joints beside it."""
    from vergence.app.goal import goal as command

    return command(options)


@app.command(epilog="Example: vergence bench control")
def bench(
    chosen: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAMES",
            help="Benchmarks to run. Default: all.",
            autocompletion=names.benchmarks,
        ),
    ] = None,
    compare_with: Annotated[
        Path | None,
        typer.Option("--compare", metavar="FILE", help="Earlier output of --json to compare with."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Run the benchmarks, together with those of other libraries."""
    from vergence.app.bench import bench as command

    raise typer.Exit(command(chosen or (), as_json, compare_with))


@app.command(epilog="Example: vergence cells")
def cells(as_json: Json = False) -> None:
    """List the built-in cells with a description of each."""
    described = {name: cell_description(name) for name in names.cells()}
    if as_json:
        emit({"command": "cells", "cells": names.cells(), "descriptions": described})
        return
    width = max(map(len, described))
    for name, text in described.items():
        say(f"{name:{width}}  {re.split(r'[.:](?: |$)', text)[0]}.")


if __name__ == "__main__":
    main()
