"""A camera on the wrist and one on the wall: together they decide what neither does alone."""

import numpy as np
import pytest

from vergence.assembly import assemble_parts, run_cell
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.geometry import se3_distance
from vergence.signals import ImagePoints, JointState, Observation
from vergence.simulation import SimulatedDriver

PERIOD = 1 / 30
GOAL = np.deg2rad([-125.6, 42.7, -172.7, 0.0, -50.0, 0.0])  # where the desired images were taken


class Ends:
    """Keeps the last errors by camera, the last joints, and what was told."""

    def __init__(self):
        self.error_px, self.told = {}, []

    def begin(self, info): ...

    def tick(self, record):
        self.position = record.sample.joints["puma"].position
        desired = {**record.reference.elsewhere_px, "wrist": record.reference.points_px}
        for view in record.observation.views if record.observation else ():
            error = np.linalg.norm(view.points_px - desired[view.camera], axis=1)
            self.error_px[view.camera] = error[view.found].max(initial=0.0)

    def event(self, time, name, text):
        self.told.append(text)

    def close(self, outcome, summary): ...


@pytest.fixture(scope="module")
def driver():
    return SimulatedDriver(load_cell("wrist_and_wall"), images=False)


def view(camera, time, points_px):
    return ImagePoints(camera, time, points_px, np.zeros((2, 2, 2)), np.ones(2, bool), ("",) * 2)


def settle(driver, cameras, ticks=400):
    """Servo on ideal joints by some of the cameras; return joints, and errors by camera in px."""
    parts = assemble_parts(driver.cell, driver, images=False)
    q = driver.read().joints["puma"].position
    reference = parts.planner.reference(0.0)
    desired = {**reference.elsewhere_px, "wrist": reference.points_px}
    for k in range(ticks):
        truth = {name: driver.frame_at(name, "puma", q).truth for name in desired}
        views = [view(name, k * PERIOD, truth[name].points_px) for name in cameras]
        joints = JointState(k * PERIOD, q, np.zeros(6))
        q = (
            q
            + PERIOD * parts.law.command(Observation(k * PERIOD, views), reference, joints).velocity
        )
    return q, {n: np.linalg.norm(truth[n].points_px - desired[n], axis=1).max() for n in desired}


def off_goal(driver, q):
    """Distance of the tip from the goal, m; a radian counts as a metre."""
    arm = driver.world.arm_to_body("puma")
    return se3_distance(arm.forward_kinematics(q), arm.forward_kinematics(GOAL), 1.0)


def test_together_they_bring_the_arm_to_the_one_place_that_shows_both_images(driver):
    q, error_px = settle(driver, ("wrist", "wall"))
    assert max(error_px.values()) < 0.05
    assert off_goal(driver, q) < 1e-3


@pytest.mark.parametrize(("alone", "other"), [("wrist", "wall"), ("wall", "wrist")])
def test_alone_each_is_content_while_the_other_image_is_wrong(driver, alone, other):
    q, error_px = settle(driver, (alone,))
    assert error_px[alone] < 0.05
    assert error_px[other] > 5.0
    assert off_goal(driver, q) > 0.02


def test_through_rendered_images_both_images_come_out_as_desired():
    ends = Ends()
    result = run_cell(load_cell("wrist_and_wall").replace(duration_s=5.0), [ends])
    assert result.outcome.succeeded
    assert ends.error_px["wrist"] < 0.3
    assert ends.error_px["wall"] < 0.3
    np.testing.assert_allclose(ends.position, GOAL, atol=np.deg2rad(0.3))


def test_the_constrained_law_serves_both_within_its_margins():
    ends = Ends()
    law = {"solver": "quadratic_program", "limits": {"view_margin_px": 40.0}}
    result = run_cell(load_cell("wrist_and_wall").replace(law=law), [ends], images=False)
    assert result.outcome.succeeded
    assert max(ends.error_px.values()) < 0.5
    np.testing.assert_allclose(ends.position, GOAL, atol=np.deg2rad(0.5))


def test_a_wall_camera_that_goes_blind_is_told_of_and_leaves_the_rest_to_the_wrist():
    ends = Ends()
    blind = {"wall": {"blind_s": [[0.3, 9.0]]}}
    cell = load_cell("wrist_and_wall").replace(duration_s=3.0, cameras=blind)
    result = run_cell(cell, [ends], images=False)
    assert result.outcome.succeeded
    assert ends.error_px["wrist"] < 1.0
    assert any("in wall" in text for text in ends.told)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"law": {"objectives": [{"kind": "image_based", "camera": "ceiling"}]}}, "ceiling"),
        ({"cameras": {"wall": {"arm": "puma"}}}, r"task\.tool\.camera.*a fixed camera"),
        ({"task": {"tool": {"camera": "walls"}}}, r"task\.tool\.camera.*wall"),
        ({"task": {"tool": {"desired": [[1, 1]]}}}, r"task\.tool\.desired.*2 points"),
        ({"task": {"tool": {"features": [[0.5, 0.0, 0.0]]}}}, r"task\.tool.*does not see"),
    ],
)
def test_a_tool_that_cannot_be_served_is_refused_by_name(change, said):
    with pytest.raises(InputError, match=said):
        run_cell(load_cell("wrist_and_wall").replace(**change), images=False)
