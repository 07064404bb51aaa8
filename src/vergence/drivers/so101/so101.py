"""The settings of an arm of Feetech servos."""

from dataclasses import field
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from vergence.drivers.arm_driver import ArmDriver
from vergence.drivers.equipment import Equipment
from vergence.drivers.so101.servo_bus import ServoBus
from vergence.drivers.so101.so101_link import So101Link
from vergence.errors import InputError
from vergence.optional_package import optional_package
from vergence.parts import knob, part
from vergence.runtime.driver import Driver

_Id = Annotated[int, Field(ge=0, le=252)]
_Tick = Annotated[int, Field(ge=0, le=4095)]
_Sign = Literal[-1, 1]


@part("driver", "so101")
class So101:
    """An SO-100, SO-101 or another arm of STS3215 servos on one serial bus."""

    # A module, and the extra that has it.
    package: ClassVar[tuple[str, str]] = (
        "scservo_sdk",
        "so101",
    )

    address: str = "/dev/ttyACM0"  # serial port of the servo adapter
    baud: int = knob(1_000_000, "baud", least=9600)  # baud rate of the servos
    ids: tuple[_Id, ...] = ()  # servo ids from the base outwards; 1, 2, 3 … if absent
    # Servo position, 0 to 4095, at each joint's zero; 2048 if absent.
    zero_ticks: tuple[_Tick, ...] = ()
    signs: tuple[_Sign, ...] = ()  # -1 for a servo that turns opposite to the model; 1 if absent
    # By name: servo id, and its positions for 0 (open) and 1 (closed).
    outputs: dict[str, tuple[_Id, _Tick, _Tick]] = field(default_factory=dict)
    # Rate at which the bus is read and written.
    rate_hz: float = knob(100.0, "Hz", least=10.0, upto=200.0)
    # Temperature above which the arm is held.
    hottest_deg_c: float = knob(70.0, "°C", least=30.0, upto=90.0)
    # Time without an answer after which the robot counts as silent.
    timeout_s: float = knob(0.5, "s", above=0.0, upto=10.0)

    def open(self, equipment: Equipment) -> Driver:
        """Open the bus and find every servo; they hold their place."""
        name = equipment.only_arm("so101")
        equipment.check_sources("so101")
        n = equipment.arms[name].joint_count
        for key in ("ids", "zero_ticks", "signs"):
            given = getattr(self, key)
            if given and len(given) != n:
                allowed = f"{n}, one per joint of {name}"
                raise InputError(equipment.source, f"driver.{key}", f"{len(given)} values", allowed)
        sdk = optional_package("so101", *self.package)
        ids = self.ids or tuple(range(1, n + 1))
        for output, (number, *_) in self.outputs.items():
            if number in ids:
                allowed = "a servo that is no joint of the arm"
                raise InputError(equipment.source, f"driver.outputs.{output}", number, allowed)
        others = tuple(number for number, *_ in self.outputs.values())
        bus = ServoBus(sdk, self.address, self.baud, ids, others)
        try:
            link = So101Link(bus, self)
            return ArmDriver(equipment, name, link, 2.0 * self.timeout_s)  # the link tells more
        except BaseException:
            bus.close()
            raise
