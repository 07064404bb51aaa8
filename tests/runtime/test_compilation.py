"""Nothing is compiled, or loaded from a cache, between the first tick of a run and its end."""

import gc
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher
from scripted_cell import ScriptedDriver, looped

from vergence.assembly.run_cell import run_driver
from vergence.cell import Cell, load_cell
from vergence.places import CELLS
from vergence.runtime import Timeouts
from vergence.runtime.loop import Loop
from vergence.signals import Sample, Setpoint
from vergence.simulation import SimulatedDriver
from vergence.studies.guarantees.driver_faults import DRIVER_FAULTS
from vergence.studies.guarantees.faulty_driver import FaultyDriver
from vergence.studies.guarantees.law_faults import LAW_FAULTS, FaultyLaw


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of what was compiled or loaded while the loop went on; all is forgotten before."""
    for kernel in gc.get_objects():
        of_numba = issubclass(
            type(kernel), Dispatcher
        )  # dead weak proxies have no class to ask for
        if of_numba and kernel.py_func.__module__.startswith("vergence"):
            kernel.overloads.clear()
            kernel._reset_overloads()
    names: list[str] = []
    running = [False]
    compile_, step, outcome = Dispatcher.compile, Loop._step, Loop._braked

    def noted(self, signature):
        if running[0]:
            names.append(f"{self.py_func.__module__}.{self.py_func.__name__}{signature}")
        return compile_(self, signature)

    def stepped(self, sample):
        ended = step(self, sample)
        running[0] = True
        return ended

    def braked(self, end):
        ended = outcome(self, end)
        running[0] = False
        return ended

    monkeypatch.setattr(Dispatcher, "compile", noted)
    monkeypatch.setattr(Loop, "_step", stepped)
    monkeypatch.setattr(Loop, "_braked", braked)
    return names


def run_for(cell: Cell, driver: SimulatedDriver, seconds: float, images: bool = True) -> None:
    """Run a cell for a while, however long its task takes."""
    loops: list[Loop] = []
    step = driver.step

    def stepped(setpoints: Mapping[str, Setpoint]) -> None:
        step(setpoints)
        if driver.time >= seconds:
            loops[0].stop()

    driver.step = stepped  # type: ignore[method-assign]
    run_driver(cell, driver, (), images, attend=lambda loop, parts: loops.append(loop))
    driver.close()


class Spoilt(SimulatedDriver):
    """Its images go bad at 0.4 s."""

    spoil = staticmethod(lambda image: image)

    def read(self) -> Sample:
        sample = super().read()
        if sample.time < 0.4:
            return sample
        frames = tuple(replace(f, image=self.spoil(f.image)) for f in sample.frames)
        return replace(sample, frames=frames)


@pytest.mark.parametrize("name", sorted(path.parent.name for path in CELLS.glob("*/cell.toml")))
def test_every_shipped_cell_runs_without_compiling_anything(name: str, compiled) -> None:
    cell = load_cell(name)
    driver = SimulatedDriver(cell)
    run_for(cell, driver, 0.4)
    assert driver.time >= 0.4
    assert compiled == []


@pytest.mark.parametrize("name", ["puma560", "eye_to_hand_pose"])
def test_exact_projections_need_no_kernel_of_their_own_while_the_arm_moves(name, compiled) -> None:
    cell = load_cell(name)
    run_for(cell, SimulatedDriver(cell, images=False), 0.4, images=False)
    assert compiled == []


@pytest.mark.parametrize("name", ["puma560", "lippiello2005"])
@pytest.mark.parametrize(
    "spoil",
    [
        lambda image: image.astype(np.uint16) * 257,
        lambda image: np.dstack((image, image, image)),
        lambda image: image.astype(float) * np.nan,
        lambda image: np.full_like(image, 90),
        lambda image: np.asfortranarray(image),
        lambda image: np.random.default_rng(0).integers(0, 255, image.shape, np.uint8),
        lambda image: None,
    ],
    ids=["16 bits", "colour", "not finite", "blank", "column by column", "noise", "none"],
)
def test_images_of_another_kind_compile_nothing(name: str, spoil, compiled) -> None:
    cell = load_cell(name)
    driver = Spoilt(cell)
    driver.spoil = spoil
    run_for(cell, driver, 0.6)
    assert compiled == []


def test_no_fault_of_a_driver_or_law_compiles_anything(compiled, caplog) -> None:
    caplog.set_level("CRITICAL")
    for fault in DRIVER_FAULTS.values():
        driver = FaultyDriver(ScriptedDriver(), fault)
        law = FaultyLaw(np.array([0.3, -0.2]))
        looped(driver, law=law, timeouts=Timeouts(robot_s=0.3)).run(1.0)
    for fault in LAW_FAULTS.values():
        driver = FaultyDriver(ScriptedDriver())
        looped(driver, law=FaultyLaw(np.array([0.3, -0.2]), fault)).run(1.0)
    assert compiled == []


def test_a_kernel_that_is_compiled_while_the_arm_moves_is_noticed(compiled, monkeypatch) -> None:
    monkeypatch.setattr("vergence.assembly.tasks.task_sequence.warm_up", lambda *arguments: None)
    cell = load_cell("puma560")
    run_for(cell, SimulatedDriver(cell), 0.3)
    assert compiled
