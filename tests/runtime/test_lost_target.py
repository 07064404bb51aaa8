"""A target that is hidden for a second and reappears elsewhere and turned is found by `follow`."""

from typing import Any

import numpy as np
import pytest

import vergence as vg

HIDDEN = (0.4, 1.5)  # s


def moving_behind(position_m: tuple[float, float, float]) -> dict[str, Any]:
    """The motion of a target that is moved and turned by 30° while the cameras are blind."""
    return {
        "kind": "poses",
        "times_s": [0.0, 0.6, 1.2, 10.0],
        "positions_m": [[0, 0, 0], [0, 0, 0], position_m, position_m],
        "rotations_rpy_deg": [[0, 0, 0], [0, 0, 0], [0, 0, 30], [0, 0, 30]],
    }


def hidden(*cameras: str) -> dict[str, Any]:
    return {name: {"blind_s": [list(HIDDEN)]} for name in cameras}


def errors_after(run: Any) -> Any:
    """Position errors of the target after it has reappeared and was found, m."""
    found = max(event.time for event in run.events if event.name == "target in sight")
    assert HIDDEN[1] <= found < HIDDEN[1] + 1.0
    after = run.pose_errors.time > found + 0.1
    return np.linalg.norm(run.pose_errors.target_m[after], axis=-1)


def test_a_mug_that_reappears_moved_and_turned_is_found_by_its_outline() -> None:
    run = vg.run(
        "mug", duration_s=3.0, cameras=hidden("wrist"), task={"target_timeout_s": 3.0},
        target={"motion": moving_behind((-0.05, 0.0, 0.0))},
    )  # fmt: skip
    assert errors_after(run).max() < 2e-3


def test_a_block_that_reappears_moved_and_turned_is_found_by_its_edges() -> None:
    run = vg.run(
        "two_blocks", duration_s=3.0, cameras=hidden("left", "right", "hand"),
        targets={"block": {"motion": moving_behind((0.05, 0.0, 0.0))}},
    )  # fmt: skip
    assert errors_after(run).max() < 1e-3


@pytest.mark.parametrize("aside", [(0.0, -0.05, 0.0), (0.04, 0.03, 0.0)])
def test_a_mug_that_hardly_differs_from_the_table_is_not_found_at_a_wrong_pose(
    aside: tuple[float, float, float],
) -> None:
    run = vg.run(
        "mug", duration_s=3.0, cameras=hidden("wrist"), task={"target_timeout_s": 3.0},
        target={"motion": moving_behind(aside)},
    )  # fmt: skip
    errors = run.pose_errors
    assert not (np.linalg.norm(errors.target_m[errors.time > HIDDEN[1]], axis=-1) > 5e-3).any()
