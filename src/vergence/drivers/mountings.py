"""Drivers that know where cameras are mounted."""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

from vergence.arrays import FloatArray


@runtime_checkable
class HasMountings(Protocol):
    """A driver whose robot says where its cameras are."""

    @property
    def mountings(self) -> Mapping[str, FloatArray]:
        """Poses T_mount_camera (4, 4) of cameras by name, in what carries each of them, m."""
        ...


def mountings_of(driver: object) -> Mapping[str, FloatArray]:
    """Return what a driver knows of mountings; nothing if it knows of none."""
    return driver.mountings if isinstance(driver, HasMountings) else {}
