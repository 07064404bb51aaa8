"""What a driver costs this computer at every tick: CPU time of `read` and `step`, in their thread.

.drivers/NAME/bin/python benchmarks/driver_cost.py NAME    (make test-drivers makes the environment)

The robot is the one of the driver's tests, in a process of its own. Waiting costs nothing, so the
figures hold on a busy computer, too.
"""

import sys
from importlib import import_module
from pathlib import Path
from time import thread_time
from typing import Any

import numpy as np

from vergence.control import Guard
from vergence.runtime import Driver

TESTS = Path(__file__).parents[1] / "tests" / "drivers"
TICKS, WARM_UP = 1000, 100
MAKES: dict[str, Any] = {  # of a robot and its driver
    "franka": lambda protocol: protocol.Robot(),
    "ros2": lambda protocol: protocol.Robot(command="velocity"),
    "so101": lambda protocol: protocol.Servos(),
    "ur": lambda protocol: protocol.Robot(),
}


def opened(name: str, protocol: Any, robot: Any) -> Driver:
    if name == "ur":
        return protocol.Ur(robot.address, **protocol.BUSY).open(protocol.BLIND)
    return robot.open()


def costs(driver: Driver) -> np.ndarray:
    """Return the CPU time of each tick, (TICKS,), s."""
    ((name, arm),) = driver.arms.items()
    guard = Guard(arm, driver.read().joints[name].position, 1.0 / driver.inner_rate_hz)
    rates = np.zeros(arm.joint_count)
    taken = []
    for tick in range(WARM_UP + TICKS):
        rates[-1] = 0.05 * np.sin(tick / driver.inner_rate_hz)
        setpoint = guard.step(rates)
        begun = thread_time()
        driver.step({name: setpoint})
        driver.read()
        taken.append(thread_time() - begun)
    return np.array(taken[WARM_UP:])


def main(name: str) -> None:
    sys.path.insert(0, str(TESTS))
    protocol = import_module(f"protocol_{name}")
    robot = MAKES[name](protocol)
    try:
        driver = opened(name, protocol, robot)
        ms = 1e3 * costs(driver)
        rate_hz = driver.inner_rate_hz
        driver.close()
    finally:
        robot.process.kill()
        robot.process.communicate()
    low, high = np.percentile(ms, [25, 75])
    print(
        f"{name}: read + step {np.median(ms):.3f} ms of CPU a tick (quartiles {low:.3f} and "
        f"{high:.3f}, mean {ms.mean():.3f}) at {rate_hz:.0f} Hz"
    )


if __name__ == "__main__":
    main(sys.argv[1])
