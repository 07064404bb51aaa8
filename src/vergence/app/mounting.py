"""`vergence calibrate --mounting`: where a robot says that its cameras are mounted."""

from typing import TYPE_CHECKING

from vergence.app.output import SUCCESS, emit, say
from vergence.app.run import overrides
from vergence.errors import NOTHING, InputError

if TYPE_CHECKING:
    from vergence.app.options import CalibrateOptions


def mounting(options: "CalibrateOptions") -> int:
    """Return what a driver knows of the mountings of a cell's cameras; return the exit code.

    Raises:
        InputError: if the driver knows of none, or the cell file cannot be changed.
    """
    from vergence.assembly import check_driver, open_driver
    from vergence.assembly.mountings import mounting_keys
    from vergence.cell import load_cell
    from vergence.cell.written_keys import lines_of, write_camera_keys
    from vergence.drivers.mountings import mountings_of

    name, driver = str(options.mounting), options.driver
    if driver is None:
        raise InputError(
            "vergence calibrate", "--mounting", name, "only together with --driver NAME[:ADDRESS]"
        )
    cell = load_cell(name, overrides(options.settings))
    check_driver(cell, driver)
    opened = open_driver(cell, driver, mounted_as_told=False)
    try:
        told = {camera: mounting_keys(T) for camera, T in mountings_of(opened).items()}
    finally:
        opened.close()
    if not told:
        allowed = "a driver that knows of some, such as ros2 with mountings in its table [driver]"
        raise InputError(str(cell.path), "driver.mountings", NOTHING, allowed)
    if options.write:
        for camera, keys in told.items():
            write_camera_keys(cell.path, camera, keys)
    if options.as_json:
        emit({"command": "calibrate", "cell": cell.name, "driver": driver, "mountings": told})
        return SUCCESS
    for camera, keys in told.items():
        written = f"written to {cell.path}" if options.write else "for the cell file, --write"
        say(f"  [cameras.{camera}], {written}:")
        for line in lines_of(keys):
            say(f"    {line}")
    return SUCCESS
