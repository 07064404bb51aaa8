"""A target that is hidden for a second and reappears elsewhere and turned is found by `follow`."""

from typing import Any

import numpy as np
import pytest

import vergence as vg

HIDDEN = (0.4, 1.5)  # s
SHORTLY = (0.4, 0.95)  # in which a mug cannot turn upside down
Span = tuple[float, float]


def moving_behind(
    position_m: tuple[float, float, float], hidden_s: Span = HIDDEN
) -> dict[str, Any]:
    """The motion of a target that is moved and turned by 30° while the cameras are blind."""
    return {
        "kind": "poses",
        "times_s": [0.0, hidden_s[0] + 0.1, hidden_s[1] - 0.1, 10.0],
        "positions_m": [[0, 0, 0], [0, 0, 0], position_m, position_m],
        "rotations_rpy_deg": [[0, 0, 0], [0, 0, 0], [0, 0, 30], [0, 0, 30]],
    }


def hidden(*cameras: str, hidden_s: Span = HIDDEN) -> dict[str, Any]:
    return {name: {"blind_s": [list(hidden_s)]} for name in cameras}


def errors_after(run: Any, hidden_s: Span = HIDDEN) -> Any:
    """Position errors of the target after it has reappeared and was found, m."""
    found = max(event.time for event in run.events if event.name == "target in sight")
    assert hidden_s[1] <= found < hidden_s[1] + 1.0
    after = run.pose_errors.time > found + 0.1
    return np.linalg.norm(run.pose_errors.target_m[after], axis=-1)


def test_a_mug_that_reappears_moved_and_turned_is_found_by_its_outline_at_most_places() -> None:
    found = 0
    for aside in ((-0.06, 0.0, 0.0), (-0.05, 0.0, 0.0), (-0.04, 0.0, 0.0), (-0.03, 0.02, 0.0)):
        run = vg.run(
            "mug", duration_s=2.5, cameras=hidden("wrist", hidden_s=SHORTLY),
            task={"target_timeout_s": 3.0}, target={"motion": moving_behind(aside, SHORTLY)},
        )  # fmt: skip
        if any(event.name == "target in sight" for event in run.events):  # else undecided
            assert errors_after(run, SHORTLY).max() < 2e-3
            found += 1
    assert found >= 2


def test_a_block_that_reappears_moved_and_turned_is_found_by_its_edges() -> None:
    run = vg.run(
        "two_blocks", duration_s=3.0, cameras=hidden("left", "right", "hand"),
        targets={"block": {"motion": moving_behind((0.05, 0.0, 0.0))}},
    )  # fmt: skip
    assert errors_after(run).max() < 1e-3


# After a second it may be upside down, which looks alike; some places hardly differ from it.
@pytest.mark.parametrize("aside", [(-0.05, 0.0, 0.0), (0.0, -0.05, 0.0), (0.04, 0.03, 0.0)])
def test_a_mug_whose_pose_is_not_decided_is_not_found_at_a_wrong_one(
    aside: tuple[float, float, float],
) -> None:
    run = vg.run(
        "mug", duration_s=3.0, cameras=hidden("wrist"), task={"target_timeout_s": 3.0},
        target={"motion": moving_behind(aside)},
    )  # fmt: skip
    errors = run.pose_errors
    assert not (np.linalg.norm(errors.target_m[errors.time > HIDDEN[1]], axis=-1) > 5e-3).any()
