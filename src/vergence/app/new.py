"""`vergence new`: a first cell for an arm of somebody's own."""

import json
import os
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

import numpy as np

from vergence.app.output import SUCCESS, emit, say
from vergence.errors import Absent, InputError
from vergence.places import CELL, other_file
from vergence.registry import kinds

if TYPE_CHECKING:
    from vergence.app.options import NewOptions
    from vergence.arrays import FloatArray
    from vergence.camera import Camera
    from vergence.simulation.draft import Bodies, Draft

_LIST = "list"  # as --body: which bodies there are
_MOST_STARTS = 20  # that are tried until the arm collides with nothing
_SHARE = 0.85  # of the image's height that the board fills
_BOARD = """<!-- A speckled board; its frame lies in the middle of its upper face. -->
<mujoco model="board">
  <asset>
    <texture name="speckles" type="2d" builtin="flat" rgb1="0.9 0.9 0.9" mark="random"
             markrgb="0.1 0.1 0.1" random="0.2" width="64" height="64"/>
    <material name="speckles" texture="speckles" specular="0"/>
  </asset>
  <worldbody>
    <body name="board">
      <geom type="box" size="{half:.3f} {half:.3f} 0.005" pos="0 0 -0.005" material="speckles"/>
    </body>
  </worldbody>
</mujoco>
"""

_TARGET = """<!-- {name}, speckled so that features are found on it. Its frame is in its middle. -->
<mujoco model="target">
  <asset>
    <texture name="speckles" type="cube" builtin="flat" rgb1="0.9 0.9 0.9" mark="random"
             markrgb="0.1 0.1 0.1" random="0.2" width="32" height="32"/>
    <material name="speckles" texture="speckles" specular="0"/>
    <mesh name="target" file={file} scale="{scale:g} {scale:g} {scale:g}" inertia="shell"/>
  </asset>
  <worldbody>
    <body name="target">
      <geom type="mesh" mesh="target" pos="{middle}" material="speckles"/>
    </body>
  </worldbody>
</mujoco>
"""

_CELL = """# A first cell for {model_name}: a camera on {body} keeps its pose relative to
# a moving {what}. `vergence new` chose start, mounting and {what}; the arm's accelerations and the
# camera are guesses, to be replaced with your own values.
name = "{name}"
duration_s = 10.0

[arms.arm]
model = "{model}"
body = "{body}"  # the arm's last body
position_m = [0.0, 0.0, {height}]  # of its base
start_deg = {start}{metres}
rate_max_deg_s = {rates}  # {rates_from}{metres_a_second}
acceleration_max_deg_s2 = {accelerations}  # a guess: see the robot's manual

[cameras.wrist]
arm = "arm"
position_m = {camera_m}  # in the last body; z points forward, x right, y down
rotation_rpy_deg = {camera_rpy}
radius_m = 0.03  # of a sphere around it, for collision checks
{lens}
rate_hz = 30.0
latency_frames = 1  # delay from exposure to arrival

[collision]
avoid = ["self", "fixtures"]  # the arm's own links, the scene; also "arms", "target"
margin_m = 0.01

[target]
model = "{what}.xml"
position_m = {target_m}
rotation_rpy_deg = {target_rpy}

[target.motion]
kind = "random"
amplitude_m = {amplitude}
amplitude_rpy_deg = [4.0, 4.0, 8.0]
start_s = 1.0

[task]
kind = "track"
arm = "arm"
camera = "wrist"
feature_count = 4  # picked in the first image

[law]
kind = "image_based"  # joint limits, view and singularities are kept by the default solver
gain = 3.0

# The same cell on the robot: uncomment the lines below, enter its driver and camera, then run
#   vergence check {name} --driver ur   checks clocks and images, then each joint by a small move
#   vergence run {name} --driver ur     moves the robot
# Drivers: {drivers}; your own is "my_robot:Driver", from my_robot.py beside this file.
# [driver]
# kind = "ur"
# address = "192.168.1.10"
#
# [driver.cameras.wrist]
# kind = "video"
# source = 0  # /dev/video0
# latency_s = 0.03  # from exposure to arrival; `vergence calibrate --latency` measures it
"""


_LENS = """resolution = [640, 480]
focal_px = [600.0, 600.0]  # your lens, see `vergence calibrate --help`"""


def new(options: "NewOptions") -> int:
    """Write a cell for an arm into a new folder, or list the bodies; return the exit code."""
    from vergence.camera import read_camera
    from vergence.cell.locate import locate_model
    from vergence.simulation.draft import SPAN, drafts, list_bodies

    path = locate_model(Path(options.model), Path.cwd(), "vergence new", "MODEL")
    if options.body == _LIST and _LIST not in (bodies := list_bodies(path)).joints:
        _tell_bodies(bodies, path.name, options.as_json)
        return SUCCESS
    folder = options.out or Path(path.stem)
    if (folder / CELL).exists():
        given = Absent(f"{folder} holds a cell already")
        raise InputError("vergence new", "", given, "--out with another folder")
    lens = None if options.camera is None else read_camera(options.camera)
    span = SPAN if lens is None else min(SPAN, _span(lens))
    target = None if options.target is None else _Target.of(options.target, options.target_scale)
    half_side_m = None if target is None else target.half_side_m
    colliding: tuple[str, ...] = ()
    for draft in islice(drafts(path, options.body, span, half_side_m), _MOST_STARTS):
        _write(folder, draft, options, path, target)
        if not (colliding := _colliding(folder)):
            break
    what = "board" if target is None else "target"
    if options.as_json:
        answer = {"cell": folder / CELL, "joints": draft.arm.names, "start": draft.start.tolist()}
        emit({**answer, "advice": [*colliding, *_advice(folder, draft)]})
    else:
        _tell(folder, options.body, draft, what, colliding)
    return SUCCESS


def _write(
    folder: Path, draft: "Draft", options: "NewOptions", path: Path, target: "_Target | None"
) -> None:
    """Write a cell and its target into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    what = "board" if target is None else "target"
    shape = _BOARD.format(half=draft.half_side_m) if target is None else target.as_mjcf(folder)
    (folder / f"{what}.xml").write_text(shape)
    packaged = options.model.startswith("package:")
    named = options.model if packaged else os.path.relpath(path, folder)
    text = _text(draft, path.name, named, options.body, folder.resolve().name, what)
    if options.camera is not None:
        calibration = json.dumps(os.path.relpath(options.camera, folder))
        text = text.replace(_LENS, f"calibration = {calibration}")
    (folder / CELL).write_text(text)


def _colliding(folder: Path) -> tuple[str, ...]:
    """Return what of the arm collides at the start of the cell in a folder."""
    from vergence.cell import load_cell
    from vergence.simulation.cell_model import CellModel
    from vergence.simulation.collision_pairs import collision_pairs

    cell = load_cell(folder)
    model, table = CellModel(cell, hulls=True), cell.collision
    return collision_pairs(model, cell.task.arm, table.avoid, table.margin_m).colliding


def _advice(folder: Path, draft: "Draft") -> list[str]:
    """Return what to know of the axes of the camera in the cell that was written."""
    from vergence.app.first_axes import poorly_measured, poorly_served
    from vergence.cell import load_cell
    from vergence.simulation.build import intrinsics

    camera = intrinsics(load_cell(folder).cameras["wrist"])
    found = (_gripper_joint(draft), poorly_measured(draft, camera), poorly_served(draft))
    return list(filter(None, found))


def _gripper_joint(draft: "Draft") -> str:
    """Say that the last joint of an arm seems to open and close a gripper, if it does."""
    from vergence.robot.arm_ends import moves_finger

    arm = draft.arm
    name, slides = arm.names[-1], bool(arm.sliding[-1])
    if not moves_finger(name, slides, arm.q_min[-1], arm.q_max[-1]):
        return ""
    return (
        f"joint {name}, the last one, seems to move a gripper: to leave it out of the "
        "arm's motion, give a body before it as --body"
    )


def _tell_bodies(bodies: "Bodies", model: str, as_json: bool) -> None:
    """List the bodies of a model, with the number of joints that move each."""
    if as_json:
        emit({"bodies": bodies.joints, "ends": bodies.ends})
        return
    say(f"bodies of {model}, and how many joints move each:")
    width = max(map(len, bodies.joints), default=0)
    for name, count in bodies.joints.items():
        note = "   the arm probably ends here" if name in bodies.ends else ""
        say(f"  {name:{width}}  {count:3d}{note}")


def _tell(folder: Path, body: str, draft: "Draft", what: str, colliding: Sequence[str]) -> None:
    from vergence.robot import unserved_directions

    say(f"wrote {folder / CELL} and {what}.xml: {len(draft.arm.names)} joints up to {body}")
    if len(draft.arm.names) < 6:
        unserved = unserved_directions(draft.J_camera, draft.distance_m)
        say(f"  with so few joints the camera {unserved} (its own axes, at the start)")
    if colliding:
        say(f"  no start without a collision was found: at this one, {colliding[0]}; enter another")
        say('  start_deg, or leave "self" out of collision.avoid')
    for line in _advice(folder, draft):
        say(f"  {line}")
    typed = shlex.quote(str(folder))
    say(f"next:  vergence watch {typed}      or  vergence run {typed}")


@dataclass(frozen=True, slots=True)
class _Target:
    """A mesh in the board's place."""

    path: Path
    scale: float  # m in a unit of the file
    middle: "FloatArray"  # (3,) of the box around it, m
    half_side_m: float

    @classmethod
    def of(cls, path: Path, scale: float) -> "_Target":
        """Measure a mesh.

        Raises:
            InputError: if it is no mesh, or cannot be read.
        """
        from vergence.vision.known_object import load_object_model

        if path.suffix.lower() not in (".obj", ".stl") or not path.is_file():
            given = f"{path}, {other_file(path)}"
            raise InputError("vergence new", "--target", given, "a mesh: .obj or .stl")
        vertices = load_object_model(path, scale).vertices
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        return cls(path, scale, (low + high) / 2, 0.5 * float((high - low)[:2].max()))

    def as_mjcf(self, folder: Path) -> str:
        """Return the model of a target in a folder."""
        return _TARGET.format(
            name=self.path.name.replace("--", "__"),
            file=quoteattr(os.path.relpath(self.path, folder)),
            scale=self.scale,
            middle=" ".join(f"{-value:.6g}" for value in self.middle),
        )


def _span(lens: "Camera") -> float:
    """Return half a side of what fills most of a camera's image at a distance of one."""
    half_width, half_height = 0.5 * lens.width / lens.fx, 0.5 * lens.height / lens.fy
    return _SHARE * min(half_width, half_height)


def _text(draft: "Draft", model_name: str, model: str, body: str, name: str, what: str) -> str:
    unit = np.where(draft.arm.sliding, 1.0, np.pi / 180)
    camera_m, camera_rpy = _placement(draft.T_body_camera)
    target_m, target_rpy = _placement(draft.T_world_target)
    return _CELL.format(
        model_name=model_name,
        what=what,
        model=model,
        body=body,
        height=draft.height_m,
        name=name,
        drivers=", ".join(kinds("driver")),
        start=_numbers(draft.start / unit, 3),
        metres="  # metres for prismatic joints" if draft.arm.sliding.any() else "",
        metres_a_second="; m/s for prismatic joints" if draft.arm.sliding.any() else "",
        rates=_limits(draft.arm.rate_max / unit),
        rates_from=draft.rates_from,
        accelerations=_limits(draft.arm.acceleration_max / unit),
        lens=_LENS,
        camera_m=camera_m,
        camera_rpy=camera_rpy,
        target_m=target_m,
        target_rpy=target_rpy,
        amplitude=_numbers(np.full(3, 0.2 * draft.half_side_m), 3),
    )


def _placement(T: "FloatArray") -> tuple[str, str]:
    """Return position_m and rotation_rpy_deg of a pose (4, 4), as a cell file has them."""
    from vergence.geometry import matrix_to_rpy

    rpy = matrix_to_rpy(np.ascontiguousarray(T[:3, :3]))[::-1]
    return _numbers(T[:3, 3], 4), _numbers(np.rad2deg(rpy), 3)


def _limits(values: "FloatArray") -> str:
    return "[" + ", ".join(f"{value:.4g}" for value in values) + "]"


def _numbers(values: "FloatArray", digits: int) -> str:
    return "[" + ", ".join(str(round(float(v), digits) + 0.0) for v in values) + "]"
