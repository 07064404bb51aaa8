"""Images that cannot be used: the features are lost with that reason, and the arm holds."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scripted_cell import Notes

from vergence.assembly import assemble_parts
from vergence.cell import load_cell
from vergence.runtime import Loop
from vergence.signals import OutcomeKind, Sample
from vergence.simulation import SimulatedDriver

SPOILT_AT = 0.4


class SpoiltImages:
    """A driver whose images go bad after a while."""

    def __init__(self, driver: SimulatedDriver, spoil: Callable[[np.ndarray], np.ndarray]) -> None:
        self._driver, self._spoil = driver, spoil
        self.speeds: list[tuple[float, float]] = []  # time, largest joint speed desired

    def __getattr__(self, name: str):
        return getattr(self._driver, name)

    def read(self) -> Sample:
        sample = self._driver.read()
        frames = tuple(
            replace(frame, image=self._spoil(frame.image)) if frame.time >= SPOILT_AT else frame
            for frame in sample.frames
        )
        return replace(sample, frames=frames)

    def step(self, setpoints) -> None:
        fastest = max(float(abs(setpoint.velocity).max()) for setpoint in setpoints.values())
        self.speeds.append((self._driver.time, fastest))
        self._driver.step(setpoints)


@pytest.mark.parametrize(
    ("spoil", "kind", "reason"),
    [
        (lambda image: image[:0], OutcomeKind.BAD_SAMPLE, "uint8, shape (0, 640); the loop needs"),
        (lambda image: image[:5, :5], OutcomeKind.BAD_SAMPLE, "shape (5, 5)"),
        (lambda image: image.astype(np.uint16), OutcomeKind.BAD_SAMPLE, "uint16"),
        (lambda image: image.astype(float) * np.nan, OutcomeKind.BAD_SAMPLE, "float64"),
        (lambda image: np.full_like(image, 90), OutcomeKind.TARGET_LOST, ""),
    ],
    ids=["empty", "too small", "16 bits", "not finite", "blank"],
)
def test_the_run_ends_by_name_with_the_reason_and_the_arm_at_rest(spoil, kind, reason) -> None:
    cell = load_cell("puma560")
    driver = SpoiltImages(SimulatedDriver(cell), spoil)
    notes = Notes()
    try:
        parts = assemble_parts(cell, driver, images=True)
        loop = Loop(
            driver,
            "puma",
            parts.perception,
            parts.planner,
            parts.law,
            outer_rate_hz=30.0,
            listeners=[notes],
        )
        outcome = loop.run(3.0)
    finally:
        driver.close()
    assert outcome.kind is kind
    assert reason in outcome.reason
    assert outcome.time < SPOILT_AT + 2 / 30 + 0.2 + 0.15
    waiting = [speed for time, speed in driver.speeds if time > SPOILT_AT + 0.2]
    assert max(waiting, default=0.0) == 0.0
    assert driver.speeds[-1][1] == 0.0
    assert all(np.isfinite(record.sample.joints["puma"].position).all() for record in notes.ticks)
