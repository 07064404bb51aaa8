"""The same starts with ViSP, where it is installed: one program, compiled here, asked once."""

import shutil
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import VergenceError
from vergence.studies.features.scene import (
    ARRIVED_PX,
    CAMERA,
    CIRCLE,
    CORNERS,
    GAIN,
    PERIOD_S,
    STEPS,
    Start,
    arm,
)
from vergence.studies.features.servo import Servoing
from vergence.studies.ideal_loop import Ending

SOURCE = Path(__file__).with_name("visp_servo.cpp")
MISSING = "Not compared with ViSP, which is not installed: apt-get install libvisp-dev g++"
_LIBRARIES = ("-lvisp_vs", "-lvisp_visual_features", "-lvisp_core")
_COMPILE_S, _RUN_S = 300.0, 1800.0
_ENDINGS = {
    "arrived": Ending.ARRIVED,
    "view": Ending.VIEW,
    "joint": Ending.JOINT,
    "short": Ending.SHORT,
    "error": Ending.SHORT,
}


class Asked(NamedTuple):
    """One servoing that ViSP is to do."""

    kind: str
    plant: str  # free, arm, or avoidance: the arm with ViSP's avoidance of joint limits
    start: Start


def installed() -> bool:
    """Whether ViSP and a compiler are here."""
    return all(shutil.which(name) for name in ("visp-config", "g++"))


def servo_with_visp(asked: Sequence[Asked]) -> tuple[str, list[Servoing]]:
    """Return ViSP's version and what became of every servoing.

    Raises:
        VergenceError: if the program cannot be compiled or fails.
    """
    with TemporaryDirectory(prefix="vergence-visp-") as folder:
        program = Path(folder) / "visp_servo"
        flags = _said("visp-config", "--cflags").split()
        _said(
            "g++", "-O2", "-std=c++17", str(SOURCE), "-o", str(program), *flags, *_LIBRARIES,
            timeout_s=_COMPILE_S,
        )  # fmt: skip
        told = " ".join(_words(asked))
        version, *lines = _said(str(program), told=told, timeout_s=_RUN_S).splitlines()
    return version, [_read(line) for line in lines]


def _said(*command: str, told: str = "", timeout_s: float = 60.0) -> str:
    try:
        done = subprocess.run(
            command, input=told, capture_output=True, text=True, timeout=timeout_s, check=True
        )
    except subprocess.CalledProcessError as error:
        last = (error.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise VergenceError(f"{Path(command[0]).name} failed: {last}") from None
    except subprocess.TimeoutExpired:
        raise VergenceError(f"{Path(command[0]).name} took over {timeout_s:g} s") from None
    return done.stdout


def _read(line: str) -> Servoing:
    ending, time_s, path_m = line.split()
    return Servoing(_ENDINGS[ending], float(time_s), float(path_m))


def _words(asked: Sequence[Asked]) -> Iterator[str]:
    """Yield the program's input, see `visp_servo.cpp`."""
    camera, model = CAMERA, arm()
    yield from map(repr, (GAIN, PERIOD_S, STEPS, float(camera.fx), float(camera.cx)))
    yield from map(repr, (float(camera.cy), camera.width, camera.height, ARRIVED_PX))
    yield str(len(CORNERS))
    yield from _numbers(CORNERS[:, :2])
    yield from map(repr, CIRCLE)
    yield str(model.joint_count)
    for R, t in zip(model.chain.rotation, model.chain.position, strict=True):
        yield from _numbers(np.column_stack((R, t)))
    yield from ("1" if slides else "0" for slides in model.chain.sliding)
    for limit in (model.q_min, model.q_max, model.rate_max):
        yield from _numbers(limit)
    yield str(len(asked))
    for kind, plant, start in asked:
        yield from (kind, plant)
        yield from _numbers(start.T_camera_target[:3])
        yield from _numbers(start.T_goal_target[:3])
        yield from _numbers(start.q)


def _numbers(values: FloatArray) -> Iterator[str]:
    return map(repr, np.asarray(values).ravel().tolist())
