"""`vergence calibrate --latency`: how late a robot's images and servo are."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from vergence.app.bring_up import carried_camera
from vergence.app.output import FAILURE, SUCCESS, emit, say
from vergence.app.run import overrides
from vergence.errors import InputError

if TYPE_CHECKING:
    from vergence.drivers.bring_up import Delay, Latencies

_SWING_DEG = 2.0


def latency(cell: str, driver: str | None, settings: Sequence[str], as_json: bool) -> int:
    """Swing a joint, print how late images and servo are; return the exit code."""
    from vergence.assembly import open_driver, rehearse
    from vergence.cell import load_cell
    from vergence.drivers.bring_up import excite, latencies

    if driver is None:
        raise InputError("calibrate", "--latency", cell, "it with --driver NAME[:ADDRESS]")
    loaded = load_cell(cell, overrides(settings))
    camera = carried_camera(loaded)
    if camera is None:
        given = f"{loaded.task.camera}, which {loaded.task.arm} does not carry"
        raise InputError(str(loaded.path), "task.camera", given, "a camera on the arm")
    rehearse(loaded)
    opened = open_driver(loaded, driver)
    try:
        seen = excite(opened, loaded.task.arm, camera, np.deg2rad(_SWING_DEG))
    finally:
        opened.close()
    found = latencies(seen)
    if as_json:
        emit(_answer(loaded.name, driver, seen.joint, found))
    else:
        say(f"{seen.joint} was swung by {_SWING_DEG:g}°")
        say(_words(f"images of {camera.name} by their stamps", found.camera))
        say(_words(f"servo of {loaded.task.arm}", found.servo))
        if not found.camera.reason:
            added = f"add {found.camera.seconds:.3f} to latency_s in [driver.cameras.{camera.name}]"
            say(f"  to do  {added}")
    return FAILURE if found.camera.reason else SUCCESS


def _words(name: str, delay: "Delay") -> str:
    if delay.reason:
        return f"  {name}: the data do not tell ({delay.reason})"
    return f"  {name}: {1e3 * delay.seconds:.1f} ± {1e3 * delay.deviation_s:.1f} ms late"


def _answer(cell: str, driver: str, joint: str, found: "Latencies") -> Mapping[str, object]:
    return {
        "command": "calibrate",
        "cell": cell,
        "driver": driver,
        "joint": joint,
        "camera": found.camera._asdict(),
        "servo": found.servo._asdict(),
    }
