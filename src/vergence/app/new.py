"""`vergence new`: a first cell for an arm of somebody's own."""

import json
import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vergence.app.output import SUCCESS, emit, say
from vergence.errors import InputError
from vergence.places import CELL

if TYPE_CHECKING:
    from vergence.arrays import FloatArray
    from vergence.camera import Camera
    from vergence.simulation.draft import Draft

_SHARE = 0.85  # of the image's height that the board fills
_BOARD = """<!-- A speckled board; its frame lies in the middle of its upper face. -->
<mujoco model="board">
  <asset>
    <texture name="speckles" type="2d" builtin="flat" rgb1="0.9 0.9 0.9" mark="random"
             markrgb="0.1 0.1 0.1" random="0.2" width="32" height="32"/>
    <material name="speckles" texture="speckles" specular="0"/>
  </asset>
  <worldbody>
    <body name="board">
      <geom type="box" size="{half:.3f} {half:.3f} 0.005" pos="0 0 -0.005" material="speckles"/>
    </body>
  </worldbody>
</mujoco>
"""

_CELL = """# A first cell for {model_name}: a camera on {body} keeps its place
# before a board that wanders. Start, mounting and board were found by `vergence new`; the arm's
# accelerations and the camera are guesses, to be replaced by your own.
name = "{name}"
duration_s = 10.0

[arms.arm]
model = "{model}"
body = "{body}"  # the arm's last body
position_m = [0.0, 0.0, {height}]  # of its base
start_deg = {start}  # metres for sliding joints
rate_max_deg_s = {rates}  # {rates_from}; m/s for sliding joints
acceleration_max_deg_s2 = {accelerations}  # a guess: see the robot's manual

[cameras.wrist]
arm = "arm"
position_m = {camera_m}  # in the last body: z looks ahead, x right, y down
rotation_rpy_deg = {camera_rpy}
{lens}
rate_hz = 30.0
latency_frames = 1  # from exposure until the image arrives

[target]
model = "board.xml"
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
"""


_LENS = """resolution = [640, 480]
focal_px = [600.0, 600.0]  # your lens, see `vergence calibrate --help`"""


def new(model: str, body: str, out: Path | None, camera: Path | None, as_json: bool) -> int:
    """Write a cell for an arm into a new folder; return the exit code."""
    from vergence.camera import read_camera
    from vergence.cell.locate import locate_model
    from vergence.simulation.draft import SPAN, draft_cell

    path = locate_model(Path(model), Path.cwd(), "vergence new", "MODEL")
    folder = out or Path(path.stem)
    if (folder / CELL).exists():
        raise InputError(str(folder), "", "a cell is there already", "--out with another folder")
    lens = None if camera is None else read_camera(camera)
    draft = draft_cell(path, body, SPAN if lens is None else min(SPAN, _span(lens)))
    folder.mkdir(parents=True, exist_ok=True)
    named = model if model.startswith("package:") else os.path.relpath(path, folder)
    (folder / "board.xml").write_text(_BOARD.format(half=draft.half_side_m))
    text = _text(draft, path.name, named, body, folder.resolve().name)
    if camera is not None:
        text = text.replace(_LENS, f"calibration = {json.dumps(os.path.relpath(camera, folder))}")
    (folder / CELL).write_text(text)
    if as_json:
        emit({"cell": folder / CELL, "joints": draft.arm.names, "start": draft.start.tolist()})
    else:
        say(f"wrote {folder / CELL} and board.xml: {len(draft.arm.names)} joints up to {body}")
        typed = shlex.quote(str(folder))
        say(f"next:  vergence watch {typed}      or  vergence run {typed}")
    return SUCCESS


def _span(lens: "Camera") -> float:
    """Return half a side of what fills most of a camera's image at a distance of one."""
    half_width, half_height = 0.5 * lens.width / lens.fx, 0.5 * lens.height / lens.fy
    return _SHARE * min(half_width, half_height)


def _text(draft: "Draft", model_name: str, model: str, body: str, name: str) -> str:
    unit = np.where(draft.arm.sliding, 1.0, np.pi / 180)
    camera_m, camera_rpy = _placement(draft.T_body_camera)
    target_m, target_rpy = _placement(draft.T_world_target)
    return _CELL.format(
        model_name=model_name,
        model=model,
        body=body,
        height=draft.height_m,
        name=name,
        start=_numbers(draft.start / unit, 3),
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
