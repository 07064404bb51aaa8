"""What a cell says of the hardware: all that a driver needs to open it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from vergence.camera import Camera
from vergence.drivers.camera_source import CameraSource
from vergence.errors import NOTHING, InputError
from vergence.robot import Arm


@dataclass(frozen=True, slots=True)
class Equipment:
    """Arms and cameras of a cell, without anything of its simulation."""

    source: str  # the cell file, for messages
    arms: Mapping[str, Arm]  # by name, with their limits
    cameras: Mapping[str, Camera]  # intrinsics by name
    inner_rate_hz: float  # of the cell; a robot that has a rate of its own keeps that
    watched: tuple[str, ...] = ()  # names of the cameras that the task needs
    sources: Mapping[str, CameraSource] = field(default_factory=dict)  # by camera name

    def only_arm(self, kind: str, joint_count: int | None = None) -> str:
        """Return the name of the cell's arm, for a driver that moves one.

        Args:
            kind: of the driver, for messages.
            joint_count: how many joints that robot has; any number if None.

        Raises:
            InputError: if the cell has several arms, or one with another number of joints.
        """
        if len(self.arms) > 1:
            given = ", ".join(self.arms)
            raise InputError(self.source, "arms", given, f"one arm: driver {kind} moves one")
        ((name, arm),) = self.arms.items()
        if joint_count not in (None, arm.joint_count):
            given = f"{arm.joint_count} joints"
            raise InputError(
                self.source, f"arms.{name}.model", given, f"{joint_count}, as the robot has"
            )
        return name

    def check_sources(self, kind: str) -> None:
        """Refuse a camera that nobody delivers images of.

        Args:
            kind: of the driver, which has no cameras of its own.

        Raises:
            InputError: if a camera that the task needs has no source.
        """
        for name in self.watched:
            if name not in self.sources:
                allowed = (
                    f'a source, such as {{ kind = "video", source = 0 }}: {kind} has no camera'
                )
                raise InputError(self.source, f"driver.cameras.{name}", NOTHING, allowed)
