"""A law that is replaced by its like while the arm moves changes nothing."""

import numpy as np
import pytest

from vergence.assembly import Parts, build_law, run_driver
from vergence.cell import load_cell
from vergence.runtime import Loop
from vergence.simulation import SimulatedDriver

SHORT = {"duration_s": "1.5"}


class Replacing(SimulatedDriver):
    """Replaces the law between two images."""

    at_s = float("inf")
    loop: Loop
    parts: Parts

    def read(self):
        if self.time >= self.at_s:
            self.at_s = float("inf")
            self.loop.replace_law(build_law(self.parts.context))
        return super().read()


def positions(cell: str, at_s: float) -> np.ndarray:
    driver = Replacing(load_cell(cell, SHORT), images=False)

    def attend(loop: Loop, parts: Parts) -> None:
        driver.loop, driver.parts, driver.at_s = loop, parts, at_s

    run = run_driver(driver.cell, driver, (), False, attend=attend)
    assert run.outcome.succeeded
    return run.arms[driver.cell.task.arm].position


@pytest.mark.parametrize("cell", ["ur5", "puma560", "lippiello2005"])
def test_a_law_replaced_by_its_like_moves_the_arm_alike(cell: str) -> None:
    np.testing.assert_allclose(positions(cell, 0.71), positions(cell, np.inf), atol=1e-12)
