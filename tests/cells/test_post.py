"""A Panda beside a post: the law keeps clear of it; a law that does not is braked before."""

import numpy as np
import pytest

import vergence as vg
from vergence.cell import load_cell
from vergence.signals import OutcomeKind
from vergence.simulation.cell_model import CellModel
from vergence.simulation.clearance import CellClearance


@pytest.fixture(scope="module")
def clearance():
    cell = load_cell("post")
    model = CellModel(cell, hulls=True)
    return CellClearance(model, "panda", cell.collision.avoid, cell.collision.margin_m)


def test_the_law_keeps_its_margin_from_the_post_and_its_features(clearance):
    run = vg.run("post", images=False, duration_s=9)
    arm = run.arms["panda"]
    assert run.outcome.succeeded, str(run.outcome)
    assert any("collision" in names for names in arm.active)
    assert not any("collision" in slack for slack in arm.slack)
    least = min(clearance.distances(q).min() for q in arm.setpoint[::3])
    assert least > 0.0095
    nearest = min(tick["fixtures"] for tick in arm.clearance if "fixtures" in tick)
    assert 0.0095 < nearest < 0.02
    assert np.nanmax(run.cameras["hand"].error_px[100:]) < 12.0


def test_without_the_limit_the_guard_brakes_before_the_post(clearance):
    law = {"limits": {"order": ["view", "singularity", "joint margin"]}}
    run = vg.run("post", images=False, duration_s=9, law=law)
    assert run.outcome.kind is OutcomeKind.COLLISION
    assert "scene/post and panda/panda_link4 would come within 5.0 mm" in run.outcome.reason
    q = run.arms["panda"].setpoint
    assert min(clearance.distances(row).min() for row in q[-30:]) > 0.005
