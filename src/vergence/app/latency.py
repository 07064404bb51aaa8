"""`vergence calibrate --latency`: how late a robot's images and servo are."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.app.bring_up import carried_camera
from vergence.app.output import FAILURE, SUCCESS, emit, say
from vergence.app.run import overrides
from vergence.assembly.open_driver import split_name
from vergence.errors import InputError

if TYPE_CHECKING:
    from vergence.app.options import CalibrateOptions
    from vergence.cell import Cell
    from vergence.drivers.bring_up import Delay, Latencies

_SWING_DEG = 2.0


def latency(options: "CalibrateOptions") -> int:
    """Swing a joint, print the delays of images and servo; return the exit code."""
    from vergence.assembly import check_driver, open_driver, rehearse
    from vergence.cell import load_cell
    from vergence.cell.settings_text import toml_value
    from vergence.cell.written_keys import write_driver_keys
    from vergence.drivers.bring_up import excite, latencies

    cell, driver = str(options.latency), options.driver
    if driver is None:
        raise InputError(
            "vergence calibrate", "--latency", cell, "only together with --driver NAME[:ADDRESS]"
        )
    loaded = load_cell(cell, overrides(options.settings))
    camera = carried_camera(loaded)
    if camera is None:
        given = f"{loaded.task.camera}, which {loaded.task.arm} does not carry"
        raise InputError(str(loaded.path), "task.camera", given, "a camera on the arm")
    check_driver(loaded, driver)
    rehearse(loaded)
    opened = open_driver(loaded, driver)
    try:
        seen = excite(opened, loaded.task.arm, camera, np.deg2rad(_SWING_DEG))
    finally:
        opened.close()
    found = latencies(seen)
    keys = _keys(loaded, driver, camera.name, found)
    if options.write and keys:
        write_driver_keys(loaded.path, split_name(driver)[0], keys)
    if options.as_json:
        emit(_answer(loaded.name, driver, seen.joint, found, keys))
    else:
        say(f"{seen.joint} was swung by {_SWING_DEG:g}°")
        say(_words(f"images of {camera.name} by their stamps", found.camera))
        say(_words(f"servo of {loaded.task.arm}", found.servo))
        if keys:
            written = f"written to {loaded.path}" if options.write else "for the cell file, --write"
            say(f"  [driver], {written}:")
            for key, value in keys.items():
                say(f"    {key} = {toml_value(value)}")
    return FAILURE if found.camera.reason else SUCCESS


def _keys(cell: "Cell", driver: str, camera: str, found: "Latencies") -> dict[str, Any]:
    """Return keys for the table `[driver]`; the images were read with what it says now."""
    table = cell.driver if cell.driver and cell.driver.kind == split_name(driver)[0] else None
    keys: dict[str, Any] = {}
    if not found.camera.reason:
        before = {} if table is None else table.stamp_latency_s
        late_s = before.get(camera, 0.0) + found.camera.seconds
        keys["stamp_latency_s"] = before | {camera: round(late_s, 4)}
    if not found.servo.reason:
        keys["servo_lag_s"] = max(round(found.servo.seconds, 4), 0.0)
    return keys


def _words(name: str, delay: "Delay") -> str:
    if delay.reason:
        return f"  {name}: not determined ({delay.reason})"
    return f"  {name}: {1e3 * delay.seconds:.1f} ± {1e3 * delay.deviation_s:.1f} ms late"


def _answer(
    cell: str, driver: str, joint: str, found: "Latencies", keys: Mapping[str, Any]
) -> Mapping[str, object]:
    return {
        "command": "calibrate",
        "cell": cell,
        "driver": driver,
        "joint": joint,
        "camera": found.camera._asdict(),
        "servo": found.servo._asdict(),
        "cell_file": keys,
    }
