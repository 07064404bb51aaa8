"""The command line.

Commands import what they need when they run, so that help comes at once.
"""

import sys
from pathlib import Path
from typing import Annotated

import typer

from vergence.app import calibrate_command, campaign_commands, driver_commands, goal_command, names
from vergence.app.options import CellName, Driver, ImageEvery, Images, Json, Out, Seed, Settings
from vergence.app.output import BAD_INPUT, SUCCESS, emit, say, warn
from vergence.errors import VergenceError
from vergence.places import find_recording
from vergence.prebuilt import use_prebuilt_kernels
from vergence.studies import PAPERS

app = typer.Typer(
    name="vergence",
    help="Visual servoing that keeps the target in view and the arm clear of its limits.",
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)

_NEXT = """vergence servoes robot arms by what their cameras see.

  vergence run puma560                    an arm follows a moving board; ends with a report to open
  vergence watch puma560                  the same in your browser, as it happens
  vergence run puma560 --no-images        without images, much faster
  vergence cells                          the cells that come with vergence
  vergence new ARM.urdf --body LAST_LINK  a first cell for an arm of yours
  vergence compare panda                  several laws from the same random starts
  vergence reproduce nelson1995 --quick   a paper's experiments, checked

  vergence --help                         all commands; each has --help with an example
  vergence --install-completion           names at the press of Tab
"""


def main() -> None:
    """Run the command line; a mistake of the user is one message and exit code 2."""
    try:
        app()
    except VergenceError as error:
        warn(f"vergence: {error}")
        sys.exit(BAD_INPUT)
    except OSError as error:  # such as a folder that cannot be written
        told = f"{error.filename}: {error.strerror}" if error.filename else str(error)
        warn(f"vergence: {told}")
        sys.exit(BAD_INPUT)


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
        warn(f"vergence: {reason}. What runs for the first time is compiled: a minute or two.")


@app.command(epilog="Example: vergence run puma560 --seed 4 --set duration_s=10")
def run(
    cell: CellName,
    out: Out = None,
    seed: Seed = None,
    images: Images = True,
    image_every: ImageEvery = 2,
    settings: Settings = None,
    driver: Driver = None,
    goal: Annotated[
        Path | None,
        typer.Option(
            metavar="PHOTO", help="Go where this was taken, by images alone; see `vergence goal`."
        ),
    ] = None,
    points: Annotated[
        str | None,
        typer.Option(
            metavar="U,V U,V …",
            help="Track these points of the first image, by pixel, whatever the task was.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Run a work cell: progress, a summary, and a folder with recording and report."""
    from vergence.app.run import run as command

    chosen = settings or ()
    code = command(cell, out, seed, images, image_every, chosen, as_json, driver, goal, points)
    raise typer.Exit(code)


@app.command(epilog="Example: vergence report runs/puma560-20250131-120000")
def report(
    run: Annotated[
        Path,
        typer.Argument(
            help="A run folder, finished or cut off, or its recording alone.",
            autocompletion=names.recordings,
        ),
    ],
    as_json: Json = False,
) -> None:
    """Make the report of a recording again."""
    find_recording(run)
    from vergence.app.report import write_report

    path = write_report(run)
    if as_json:
        emit({"command": "report", "run": path.parent, "report": path})
    else:
        say(f"report  {path}")


@app.command(epilog="Example: vergence plan gantry --planner potential_field")
def plan(
    cell: Annotated[
        str,
        typer.Argument(
            help="Name of a built-in cell, a cell file or folder, whose task is to reach.",
            autocompletion=names.cells,
        ),
    ],
    planner: Annotated[
        str | None,
        typer.Option(
            help="optimised or potential_field, instead of the cell's.",
            autocompletion=names.planners,
        ),
    ] = None,
    out: Out = None,
    seed: Seed = None,
    images: Images = True,
    settings: Settings = None,
    as_json: Json = False,
) -> None:
    """Plan the way between two images and draw it; nothing moves."""
    from vergence.app.plan import Request
    from vergence.app.plan import plan as command

    raise typer.Exit(command(Request(cell, planner, images, seed, settings or ()), out, as_json))


@app.command(epilog="Example: vergence reproduce nelson1995 --quick")
def reproduce(
    paper: Annotated[
        str, typer.Argument(help=f"Which paper: {', '.join(PAPERS)}.", autocompletion=names.papers)
    ],
    quick: Annotated[
        bool, typer.Option("--quick", help="Exact projections instead of images: under a minute.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Random seed.", min=0)] = 0,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Repeat a paper's experiments: figures, and a table of what it says and what we measure."""
    from vergence.app.reproduce import reproduce as command

    raise typer.Exit(command(paper, quick, seed, out, as_json))


@app.command(
    epilog="Example: vergence track footage/ --model box.obj --fx 548 --start 0.02,0.1,0.5,0,180,0"
)
def track(
    images: Annotated[str, typer.Argument(help="A folder of images, or a video.")],
    model: Annotated[str, typer.Option(help="The object: an OBJ, STL or MJCF file.")],
    start: Annotated[
        str,
        typer.Option(
            help="The object's pose in the camera, in the first image: "
            "x,y,z,roll,pitch,yaw in metres and degrees, or a TOML, JSON or YAML file."
        ),
    ],
    camera: Annotated[
        Path | None, typer.Option(help="Intrinsics: a TOML, JSON or YAML file, ROS's too.")
    ] = None,
    fx: Annotated[float | None, typer.Option("--fx", help="Focal length, pixels.")] = None,
    fy: Annotated[float | None, typer.Option("--fy", help="As --fx if absent.")] = None,
    cx: Annotated[float | None, typer.Option("--cx", help="The middle if absent.")] = None,
    cy: Annotated[float | None, typer.Option("--cy", help="The middle if absent.")] = None,
    distortion: Annotated[str | None, typer.Option(help="k1,k2,p1,p2,k3; zero if absent.")] = None,
    rate: Annotated[float | None, typer.Option(help="Images per second.")] = None,
    scale: Annotated[float, typer.Option(help="Metres in a unit of the model file.")] = 1.0,
    contrast: Annotated[float, typer.Option(help="Least step of an edge, grey levels.")] = 5.0,
    jolt: Annotated[float, typer.Option(help="Unforeseen motion, pixels per image.")] = 3.0,
    share: Annotated[
        float, typer.Option(help="Least share of the edges to be found, for an image to count.")
    ] = 0.5,
    overlay: Annotated[
        bool, typer.Option("--overlay/--no-overlay", help="Write a film with the object drawn in.")
    ] = True,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Follow a known object through footage: poses, covariances, an overlay film."""
    from vergence.app.track import Request
    from vergence.app.track import track as command

    intrinsics = {"fx": fx, "fy": fy, "cx": cx, "cy": cy}
    request = Request(
        images,
        model,
        start,
        camera,
        intrinsics,
        distortion,
        rate,
        scale,
        contrast,
        jolt,
        share,
        overlay,
    )
    raise typer.Exit(command(request, out, as_json))


@app.command(epilog="Example: vergence new my_robot.urdf --body tool0")
def new(
    model: Annotated[
        str, typer.Argument(help="URDF or MJCF file of the arm; or package:NAME/PATH.")
    ],
    body: Annotated[
        str,
        typer.Option(
            help="Last body of the arm; the camera is mounted on it. Omit it to list the bodies."
        ),
    ] = "",
    out: Annotated[Path | None, typer.Option(help="Folder, instead of the model's name.")] = None,
    camera: Annotated[
        Path | None, typer.Option(help="Camera file with the lens, as `calibrate` writes it.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write a first cell for an arm of yours: start, camera and target are found."""
    from vergence.app.new import new as command

    raise typer.Exit(command(model, body, out, camera, as_json))


@app.command(epilog="Example: vergence watch puma560    or vergence watch runs/NAME-TIME")
def watch(
    source: Annotated[
        str,
        typer.Argument(
            metavar="CELL|RUN",
            help="Name of a built-in cell, a cell file or folder; or the folder of a run.",
            autocompletion=names.cells,
        ),
    ],
    out: Out = None,
    seed: Seed = None,
    images: Images = True,
    image_every: ImageEvery = 5,
    settings: Settings = None,
    host: Annotated[
        str, typer.Option(help="Where to listen; only this machine can reach the default.")
    ] = "127.0.0.1",
    port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="8230 or the next free one if absent.")
    ] = None,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
    as_json: Json = False,
) -> None:
    """Watch a cell run, or a recording, in the browser: turn its knobs, drag its target."""
    from vergence.app.watch import Request
    from vergence.app.watch import watch as command

    request = Request(
        source, out, seed, images, image_every, settings or (), host, port, browser, as_json
    )
    raise typer.Exit(command(request))


campaign_commands.register(app)
calibrate_command.register(app)
driver_commands.register(app)
goal_command.register(app)


@app.command(epilog="Example: vergence bench control")
def bench(
    chosen: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAMES", help="Which benchmarks; all if none.", autocompletion=names.benchmarks
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Run the benchmarks, peers beside us."""
    from vergence.app.bench import bench as command

    raise typer.Exit(command(chosen or (), as_json))


@app.command(epilog="Example: vergence cells")
def cells(as_json: Json = False) -> None:
    """List the cells that come with vergence."""
    if as_json:
        emit({"command": "cells", "cells": names.cells()})
        return
    for name in names.cells():
        say(name)


if __name__ == "__main__":
    main()
