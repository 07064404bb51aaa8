"""The constrained servo serves every task: features tracked, a pose followed, a plan kept to."""

import numpy as np
import pytest

from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.errors import InputError


class Kept:
    """Listens to what shaped the commands, and to how near each feature came to the border."""

    def __init__(self, camera):
        self.camera, self.named, self.rooms_px = camera, set(), []

    def begin(self, info):
        self.size = np.array([info.cameras[self.camera].width, info.cameras[self.camera].height])

    def tick(self, record):
        for command in record.commands.values():
            self.named |= {*command.active, *command.slack}
        for frame in record.sample.frames:
            if frame.camera == self.camera:
                points = frame.truth.points_px
                self.rooms_px.append(np.minimum(points, self.size - 1 - points).min(axis=1))

    def event(self, time, name, text): ...

    def close(self, outcome, summary): ...


def run(name, camera, **settings):
    keys = {key.replace("__", "."): value for key, value in settings.items()}
    kept = Kept(camera)
    law = {"law": "{ kind = 'image_based' }"} if name == "gantry" else {}
    return run_cell(
        load_cell(name, {"law.solver": "quadratic_program", **law, **keys}), [kept], images=False
    ), kept


def test_a_pose_is_followed_as_closely_as_without_constraints():
    result, kept = run("lippiello2005", "hand", duration_s="5")
    assert result.outcome.succeeded
    assert result.summary["max_pose_error_m"] < 4e-3
    assert result.summary["min_manipulability_ratio"] > 0.5
    assert not any("no solution" in name for name in kept.named)


def least_room_px(solver):
    """Turn the tip far round the block; how near the border its corners come on the way.

    Those count that the goal shows, once the filter knows the block.
    """
    goal = "{ position_m = [0.09, 0.0, 0.40], rotation_rpy_deg = [20, 70, -60] }"
    result, kept = run(
        "lippiello2005", "hand", law__solver=solver, task__desired=goal, duration_s="3.5"
    )
    assert result.summary["final_pose_error_m"] < 1e-3
    rooms = np.array(kept.rooms_px)
    return rooms[10:, rooms[-1] > 10].min()


def test_a_pose_is_reached_with_the_target_in_view_all_the_way():
    assert least_room_px("quadratic_program") > 5.0
    assert least_room_px("damped_pseudo_inverse") < -100.0


def test_a_plan_is_kept_to():
    fast = {"task__camera_speed_m_s": "0.6", "law__gain": "2"}
    result, kept = run("gantry", "eye", **fast)
    assert result.outcome.succeeded
    assert result.summary["final_error_px"] < 0.5
    assert np.min(kept.rooms_px) > 4.0


@pytest.mark.parametrize(
    ("cell", "objective", "suits"),
    [
        ("puma560", "position_based", "for the task track: objectives on image points"),
        ("lippiello2005", "image_based", "for the task follow: position_based"),
        ("gantry", "position_based", "for the task reach: objectives on image points"),
    ],
)
def test_an_objective_that_does_not_suit_the_task_is_refused(cell, objective, suits):
    with pytest.raises(InputError, match=suits) as caught:
        run_cell(load_cell(cell, {"law": f"{{ kind = '{objective}' }}"}), images=False)
    assert caught.value.key == "law.kind"
