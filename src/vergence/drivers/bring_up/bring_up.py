"""All checks of a robot, one after another."""

from collections.abc import Iterator, Mapping

import numpy as np

from vergence.drivers.bring_up.at_rest import clock_findings, image_findings, joint_findings
from vergence.drivers.bring_up.finding import Finding
from vergence.drivers.bring_up.nudges import CarriedCamera, nudge_findings
from vergence.drivers.bring_up.watched import watch
from vergence.runtime.driver import Driver

__all__ = ["CarriedCamera", "bring_up"]


def bring_up(
    driver: Driver,
    arm: str,
    rates_hz: Mapping[str, float],
    camera: CarriedCamera | None,
    nudge_rad: float,
    nudge_m: float,
    seconds: float = 3.0,
) -> Iterator[Finding]:
    """Check a robot: clock, joints and images at rest, then every joint by a small move.

    Joints are not moved before everything at rest holds.

    Args:
        driver: of the robot.
        arm: name of the arm to check.
        rates_hz: of the cameras that the task needs, by name.
        camera: on the arm, if there is one.
        nudge_rad: how far to turn each joint.
        nudge_m: how far to slide each joint that slides.
        seconds: how long to watch the robot at rest.

    Yields:
        A finding as soon as there is one.

    Raises:
        DriverSilent: if the robot does not answer.
    """
    seen = watch(driver, arm, seconds, lambda: driver.step({}))
    holds = True
    for found in (
        *clock_findings(seen, driver.inner_rate_hz),
        *joint_findings(seen, driver.arms[arm]),
        *image_findings(seen, driver.cameras, rates_hz),
    ):
        holds &= found.holds
        yield found
    if holds:
        by = np.where(driver.arms[arm].sliding, nudge_m, nudge_rad)
        yield from nudge_findings(driver, arm, by, camera)
