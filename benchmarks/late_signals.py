"""What it is worth to know how late images and servo are: the table in docs/drivers.md.

python benchmarks/late_signals.py

A UR5 over a board that wanders, on rendered images. Images come late and are stamped when they
come, as by a USB camera; the servo does late what it is told. The loop either takes stamps and
joints as they are, or has been told of both delays, as `vergence calibrate --latency` writes them.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vergence.assembly import run_driver
from vergence.cell import load_cell
from vergence.runtime import Driver, DriverWrapper
from vergence.runtime.hardware import JointHistory, LateStamps
from vergence.signals import Frame, Sample, Setpoint
from vergence.simulation import SimulatedDriver

DELAYS_S = ((0.0, 0.0), (0.05, 0.0), (0.1, 0.0), (0.15, 0.0), (0.0, 0.05), (0.0, 0.1), (0.0, 0.15))
DELAYS_S = (*DELAYS_S, (0.05, 0.05), (0.1, 0.1))
SMOOTHING_S = (0.2, 0.1)  # of the target's motion: what a cell has by itself, and less
SETTLED_S, DURATION_S = 2.0, 12.0


class LateSignals(DriverWrapper):
    """Passes on to a driver whose images and servo are late.

    Args:
        driver: whose images are not.
        image_s: from when an image would come to when it does; it is stamped then.
        servo_s: from a set-point to when the servo gets it.
    """

    def __init__(self, driver: Driver, image_s: float, servo_s: float) -> None:
        super().__init__(driver)
        self._image_s, self._ticks = image_s, round(servo_s * driver.inner_rate_hz)
        self._told: deque[Mapping[str, Setpoint]] = deque()
        self._waiting: deque[Frame] = deque()
        ticks = round(driver.inner_rate_hz)
        self._history = {name: JointHistory(ticks) for name in driver.arms}

    def read(self) -> Sample:
        sample = self.driver.read()
        for name, state in sample.joints.items():
            self._history[name].add(state)
        self._waiting += sample.frames
        frames = []
        while self._waiting and self._waiting[0].time + self._image_s <= sample.time + 1e-9:
            frame = self._waiting.popleft()
            stamp = frame.time + self._image_s
            joints = {name: self._history[name].at(stamp) for name in frame.joints}
            frames.append(replace(frame, time=stamp, joints=joints))
        return replace(sample, frames=tuple(frames))

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        self._told.append(setpoints)
        late = len(self._told) > self._ticks
        self.driver.step(self._told.popleft() if late else {})


def error_px(image_s: float, servo_s: float, told: bool, smoothing_s: float) -> str:
    """Return the features' error once settled, root mean square, px; or how the run ended."""
    settings = {"duration_s": str(DURATION_S), "law.flow_smoothing_s": str(smoothing_s)}
    cell = load_cell("ur5", settings)
    driver: Driver = LateSignals(SimulatedDriver(cell), image_s, servo_s)
    if told:
        driver = LateStamps(driver, {"wrist": image_s})
    run = run_driver(cell, driver, (), images=True, servo_lag_s=servo_s if told else 0.0)
    driver.close()
    trace = run.cameras["wrist"]
    if not run.outcome.succeeded or trace.time[-1] < SETTLED_S:
        return str(run.outcome.kind)
    error = trace.error_px[trace.time > SETTLED_S]
    return f"{np.sqrt(np.nanmean(error**2)):.1f}"


def main() -> None:
    print("| images late by | servo late by | " + " | ".join(
        f"{what}, smoothing {s:g} s" for s in SMOOTHING_S for what in ("not told", "told")
    ) + " |")  # fmt: skip
    for image_s, servo_s in DELAYS_S:
        found = [error_px(image_s, servo_s, t, s) for s in SMOOTHING_S for t in (False, True)]
        cells = f"{1e3 * image_s:.0f} ms", f"{1e3 * servo_s:.0f} ms", *found
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
