"""Several targets at once: each has a pose filter, and what one hides of another is predicted."""

from typing import Any

import numpy as np
import pytest

import vergence as vg
from vergence.errors import InputError
from vergence.geometry import angle_between


class _Watched:
    """Every target's errors, and how many hidden points were looked for in vain."""

    def __init__(self) -> None:
        self.error_m: dict[str, list[float]] = {}
        self.error_rad: dict[str, list[float]] = {}
        self.in_vain = self.asked = self.in_the_way = 0

    def begin(self, info: Any) -> None: ...

    def event(self, time: float, name: str, text: str) -> None: ...

    def close(self, outcome: Any, summary: Any) -> None: ...

    def tick(self, record: Any) -> None:
        if record.observation is None:
            return
        truths = {(frame.camera, frame.time): frame.truth for frame in record.sample.frames}
        for name, seen in {"": record.observation, **record.observation.others}.items():
            for view in seen.views:
                truth = truths[view.camera, view.time]
                truth = truth.others[name] if name else truth
                self.asked += int(view.asked.sum())
                self.in_vain += int((view.asked & ~truth.visible).sum())
                self.in_the_way += view.reasons.count("something in the way")
                if seen.target is not None and seen.target.time == view.time:
                    T, true = seen.target.T_world_target, truth.T_world_target
                    away = float(np.linalg.norm(T[:3, 3] - true[:3, 3]))
                    self.error_m.setdefault(name, []).append(away)
                    self.error_rad.setdefault(name, []).append(angle_between(T, true))


def watched(images: bool = False, **changes: Any) -> _Watched:
    listener = _Watched()
    run = vg.run("two_blocks", images=images, listeners=[listener], **changes)
    assert run.outcome.succeeded
    return listener


def test_both_are_followed_through_occlusion_and_what_is_hidden_is_not_looked_for() -> None:
    seen = watched(duration_s=12.0)
    assert seen.error_m.keys() == {"", "wedge"}
    for name in seen.error_m:
        settled = np.array(seen.error_m[name][90:]), np.array(seen.error_rad[name][90:])
        assert len(settled[0]) > 700  # three cameras, never lost
        assert settled[0].max() < 2e-3
        assert settled[1].max() < np.deg2rad(1.5)
    assert seen.in_the_way > 100
    assert seen.in_vain < 0.001 * seen.asked


def test_without_prediction_hidden_points_are_looked_for_in_vain() -> None:
    seen = watched(duration_s=12.0, perception={"occlusion": False})
    assert seen.in_vain > 0.01 * seen.asked


def test_both_are_followed_in_images() -> None:
    seen = watched(images=True, duration_s=5.0)
    for name in ("", "wedge"):
        assert max(seen.error_m[name][90:]) < 2e-3


def test_the_arm_follows_the_one_that_the_task_names() -> None:
    line = {"kind": "line", "velocity_m_s": [-0.03, 0.0, 0.0], "distance_m": 0.06}
    wedge = {"position_m": [0.95, 0.0, 0.85], "motion": line}
    away = {"position_m": [1.17, -0.19, 0.85]}
    run = vg.run(
        "two_blocks",
        images=False,
        duration_s=4.0,
        task={"target": "wedge"},
        targets={"wedge": wedge, "block": away},
    )
    assert run.outcome.succeeded
    assert run.summary["final_pose_error_m"] < 5e-3
    hand = run.cameras["hand"]
    for T in (hand.T_world_target, hand.T_world_camera):
        assert T[-1, :3, 3] - T[0, :3, 3] == pytest.approx([-0.06, 0.0, 0.0], abs=5e-3)


def test_a_target_that_no_camera_sees_at_the_start_is_named() -> None:
    with pytest.raises(InputError) as caught:
        vg.run("two_blocks", images=False, targets={"block": {"position_m": [9.0, 0.0, 0.0]}})
    assert caught.value.key == "targets.block"


def test_features_lie_on_the_surface_of_the_target_that_has_them() -> None:
    front = [[-0.08, -0.06, -0.05], [0.08, -0.06, -0.05], [0.015, -0.06, 0.0]]
    top = [[-0.08, -0.06, 0.055], [-0.07, 0.06, 0.055], [-0.01, 0.0557143, 0.055]]
    run = vg.run(
        "two_blocks", images=False, duration_s=2.0, targets={"block": {"features": front + top}}
    )
    assert run.outcome.succeeded
    assert run.summary["final_pose_error_m"] < 5e-3
