"""A beam that hides the target hides it no longer where the order of constraints says so."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.control.limits import AXES, HALF, MIDDLE, RADIUS
from vergence.simulation import SimulatedDriver
from vergence.simulation.solids import Solids

BEAM = (
    '<geom name="beam" type="capsule" size="0.02" fromto="0.21 -0.63 0.6 0.21 0.2 0.6" '
    'contype="0" conaffinity="0"/>'
)


class Hidden:
    """Listens to how many images show less than the whole target."""

    def __init__(self):
        self.images, self.named = 0, set()

    def begin(self, info): ...

    def tick(self, record):
        self.images += sum(not frame.truth.visible.all() for frame in record.sample.frames)
        self.named |= {name for command in record.commands.values() for name in command.active}

    def event(self, time, name, text): ...

    def close(self, outcome, summary): ...


@pytest.fixture
def cell(tmp_path: Path):
    """The Puma over a board that moves by under a beam."""
    room = (files("vergence") / "cells" / "puma560" / "room.xml").read_text()
    (tmp_path / "room.xml").write_text(room.replace("</worldbody>", BEAM + "</worldbody>"))
    return load_cell(
        "puma560",
        {
            "scene.model": str(tmp_path / "room.xml"),
            "target.features": str([[x, y, 0.0] for x in (-0.05, 0.05) for y in (-0.05, 0.05)]),
            "target.motion": '{ kind = "line", velocity_m_s = [0.05, 0, 0], distance_m = 0.3 }',
            "law": '{ kind = "image_based", gain = 2 }',
            "duration_s": "8",
        },
    )  # fmt: skip


def test_a_beam_hides_the_target_only_where_sight_lines_are_not_kept(cell):
    kept, given_away = Hidden(), Hidden()
    result = run_cell(cell, [kept], images=False)
    run_cell(
        cell.replace(law={"limits": {"order": ["view", "singularity", "joint margin"]}}),
        [given_away],
        False,
    )
    assert given_away.images > 20
    assert kept.images == 0
    assert "occlusion" in kept.named
    assert result.outcome.succeeded
    assert result.summary["final_error_px"] < 15.0


def test_solids_are_where_mujoco_has_the_fixtures_and_the_other_arm():
    driver = SimulatedDriver(load_cell("four_cameras"), images=False)
    model, world = driver.world.model, driver.world
    solids = Solids(world, "follower")()
    names = ["scene/post", "scene/beam", "scene/rope", "scene/crate"]  # the floor hides nothing
    assert len(solids) == 4 + sum(
        world.model.body(body).name.startswith("watcher/") for body in model.geom_bodyid
    )
    for row, name in zip(solids, names, strict=False):
        geom = model.geom(name).id
        np.testing.assert_array_equal(row[MIDDLE:HALF], world.data.geom_xpos[geom])
        np.testing.assert_array_equal(row[AXES:MIDDLE], world.data.geom_xmat[geom])
    np.testing.assert_array_equal(solids[0, HALF:], [0, 0, 0.75, 0.025])
    np.testing.assert_array_equal(solids[1, HALF:], [0.30, 0.02, 0.02, 0.0])
    assert solids[2, RADIUS] == 0.012
    before = solids[-1, MIDDLE:HALF].copy()
    world.place_arm("watcher", world.joint_position("watcher") + 0.1)
    assert np.abs(Solids(world, "follower")()[-1, MIDDLE:HALF] - before).max() > 1e-3
