"""The driver that a command names, with the settings of the cell's table `[driver]`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vergence.assembly.mountings import check_mountings
from vergence.cell import Cell
from vergence.cell.schema import DriverTable
from vergence.drivers import CameraSource, Equipment
from vergence.drivers.mountings import mountings_of
from vergence.errors import InputError, VergenceError
from vergence.loading import Place, load_part, make_part
from vergence.optional_package import optional_package
from vergence.raised import raised
from vergence.registry import find, kinds
from vergence.runtime import Driver
from vergence.runtime.hardware import LateStamps


def open_driver(cell: Cell, named: str, *, mounted_as_told: bool = True) -> Driver:
    """Return a driver for a cell, its images at the times of their exposure.

    Args:
        cell: whose arms and cameras it drives; its table `[driver]` has the settings, if it is of
            the same kind.
        named: ``NAME``, or ``module:Class`` of your own in a file beside the cell, in the current
            folder or in an installed package; followed by ``:ADDRESS`` if the driver takes one.
        mounted_as_told: whether cameras have to be mounted as the robot says, if it says.

    Raises:
        InputError: if there is no such driver, it cannot be opened, or a camera is mounted
            elsewhere than in the cell.
        DriverSilent: if the robot does not answer.
    """
    kind, _ = split_name(named)
    driver = _opened(cell, named)
    if mounted_as_told:
        try:
            check_mountings(cell, mountings_of(driver))
        except BaseException:
            driver.close()
            raise
    table = _table(cell, kind)
    if table is None or not table.stamp_latency_s:
        return driver
    return LateStamps(driver, table.stamp_latency_s)


def check_driver(cell: Cell, named: str) -> None:
    """Check what can be known of a driver without opening it; for arguments see `open_driver`.

    Raises:
        InputError: if there is no such driver, or its settings or cameras cannot be used.
    """
    kind, address = split_name(named)
    cls = find("driver", kind, folder=_folder(cell, kind), source="--driver", key="")
    settings, place = _settings(cell, kind)
    if hasattr(cls, "open"):
        made = _made(cls, kind, settings | ({"address": address} if address else {}), place)
        if hasattr(made, "check"):
            made.check(str(cell.path))
    if package := getattr(cls, "package", None):
        optional_package(kind, *package)
    _sources(cell)


def servo_lag_s(cell: Cell, named: str) -> float:
    """Return by how much a driver's arm follows late, as the cell's table `[driver]` has it, s."""
    table = _table(cell, split_name(named)[0])
    return 0.0 if table is None else table.servo_lag_s


def _opened(cell: Cell, named: str) -> Driver:
    kind, address = split_name(named)
    cls = find("driver", kind, folder=_folder(cell, kind), source="--driver", key="")
    settings, place = _settings(cell, kind)
    if not hasattr(cls, "open"):
        return _own(cls, cell, named, {"address": address, **settings})
    if address:
        settings["address"] = address
    part = _made(cls, kind, settings, place)
    driver: Driver = _guarded(named, lambda: part.open(equipment(cell)))
    return driver


def _made(cls: Any, kind: str, settings: Mapping[str, Any], place: Place) -> Any:
    """Return a driver's part; of one without an address, say where that is given."""
    try:
        return make_part(cls, settings, place)
    except InputError as error:
        if error.given == "nothing" and error.key.split(".")[-1] == "address":
            needed = f"{kind}:ADDRESS, or address in the cell's table [driver]"
            raise InputError("--driver", "", kind, needed) from None
        raise


def split_name(named: str) -> tuple[str, str]:
    """Return the kind and the address of ``NAME:ADDRESS`` or ``module:Class:ADDRESS``."""
    first, _, rest = named.partition(":")
    if first in kinds("driver"):
        return first, rest
    name, _, address = rest.partition(":")
    return f"{first}:{name}" if name else first, address


def equipment(cell: Cell) -> Equipment:
    """Return what a cell says of its hardware.

    Raises:
        InputError: if its models cannot be read, or a source of `[driver.cameras]` is of no camera.
    """
    from vergence.simulation.cell_model import CellModel

    model = CellModel(cell)
    return Equipment(
        str(cell.path), model.arms, model.cameras, cell.inner_rate_hz, cell.watched, _sources(cell)
    )


def _settings(cell: Cell, kind: str) -> tuple[dict[str, Any], Place]:
    """Return the fields of the cell's `[driver]`, if it is of this kind, and their place in it."""
    table = _table(cell, kind)
    if table is None:
        return {}, Place("--driver", "", cell.path.parent)
    return dict(table.model_extra or {}), Place(str(cell.path), "driver", cell.path.parent)


def _table(cell: Cell, kind: str) -> DriverTable | None:
    """Return the cell's `[driver]`, if that is of this kind."""
    table = cell.driver
    if table is None or table.kind != kind:
        return None
    for name in table.stamp_latency_s:
        if name not in cell.cameras:
            key, allowed = "driver.stamp_latency_s", f"cameras: {', '.join(cell.cameras)}"
            raise InputError(str(cell.path), key, name, allowed)
    return table


def _sources(cell: Cell) -> Mapping[str, CameraSource]:
    table = cell.driver or DriverTable(kind="")
    place = Place(str(cell.path), "driver.cameras", cell.path.parent)
    for name in table.cameras:
        if name not in cell.cameras:
            raise InputError(place.source, place.key, name, f"cameras: {', '.join(cell.cameras)}")
    return {
        name: load_part("camera_source", given, place.at(name))
        for name, given in table.cameras.items()
    }


def _own(cls: Any, cell: Cell, named: str, values: Mapping[str, Any]) -> Driver:
    """Return a driver whose class takes the cell, an address, and keywords."""
    rest = {key: value for key, value in values.items() if key != "address"}
    driver: Driver = _guarded(named, lambda: cls(cell, values["address"], **rest))
    return driver


def _guarded(named: str, opened: Any) -> Any:
    try:
        return opened()
    except VergenceError:
        raise
    except Exception as error:
        given = f"{named}, which raised {raised(error)}"
        raise InputError("--driver", "", given, "a driver that opens") from error


def _folder(cell: Cell, kind: str) -> Path:
    """Return where the file of a user's own driver lies: beside the cell, or here."""
    beside, module = cell.path.parent, kind.partition(":")[0]
    return beside if (beside / f"{module}.py").is_file() else Path.cwd()
