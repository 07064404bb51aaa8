"""A whole cell: the Puma follows its board, the same way every time."""

from collections.abc import Mapping

import numpy as np
import pytest

from vergence.assembly import run_cell, run_driver
from vergence.cell import Cell, load_cell
from vergence.signals import OutcomeKind
from vergence.simulation import SimulatedDriver


class Trace:
    """Keeps what a run did, as arrays."""

    def __init__(self) -> None:
        self.positions: list[np.ndarray] = []
        self.velocities: list[np.ndarray] = []
        self.points: list[np.ndarray] = []
        self.rates: list[np.ndarray] = []
        self.truths: list[np.ndarray] = []
        self.images: list[bytes] = []

    def begin(self, info) -> None:
        self.info = info

    def tick(self, record) -> None:
        joints = record.sample.joints["puma"]
        self.positions.append(joints.position)
        self.velocities.append(joints.velocity)
        for command in record.commands.values():
            self.rates.append(command.velocity)
        if record.observation is not None:
            self.points.append(record.observation.views[-1].points_px)
        for frame in record.sample.frames:
            self.truths.append(frame.truth.points_px)
            if frame.image is not None:
                self.images.append(frame.image.tobytes())

    def event(self, time: float, name: str, text: str) -> None: ...

    def close(self, outcome, summary: Mapping[str, object]) -> None:
        self.outcome = outcome

    def arrays(self) -> list[np.ndarray]:
        return [
            np.array(part)
            for part in (self.positions, self.velocities, self.points, self.rates, self.truths)
        ]


def shortened(duration_s: float, **overrides: str) -> Cell:
    keys = {"duration_s": str(duration_s)}
    return load_cell("puma560", keys | {k.replace("__", "."): v for k, v in overrides.items()})


def traced(cell: Cell, images: bool) -> tuple[Trace, dict[str, float]]:
    trace = Trace()
    result = run_cell(cell, [trace], images=images)
    assert result.outcome == trace.outcome
    return trace, result.summary


def test_on_exact_projections_the_board_is_followed_within_all_limits() -> None:
    trace, summary = traced(shortened(9.0, target__motion__distance_m="0.6"), images=False)
    assert trace.outcome.kind is OutcomeKind.COMPLETED
    assert summary["max_error_px"] < 32
    assert summary["final_error_px"] < 0.5
    arm = trace.info.arms["puma"]
    positions, velocities, *_ = trace.arrays()
    assert (positions > arm.q_min).all()
    assert (positions < arm.q_max).all()
    assert (abs(velocities) < 1.05 * arm.rate_max).all()
    assert summary["min_penalty"] > 0.2


def test_exact_runs_are_the_same_bit_for_bit() -> None:
    cell = shortened(1.0)
    first, again = (traced(cell, images=False)[0].arrays() for _ in range(2))
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one, other)


def test_rendered_runs_are_the_same_bit_for_bit_and_another_seed_is_another_run() -> None:
    cell = shortened(0.4)
    first, again = (traced(cell, images=True)[0] for _ in range(2))
    assert first.images == again.images
    assert len(first.images) > 5
    for one, other in zip(first.arrays(), again.arrays(), strict=True):
        np.testing.assert_array_equal(one, other)
    reseeded, _ = traced(shortened(0.4, seed="2"), images=True)
    assert reseeded.images[0] != first.images[0]


def test_on_rendered_images_the_tracked_point_stays_on_the_true_one() -> None:
    trace, summary = traced(shortened(1.5), images=True)
    assert trace.outcome.kind is OutcomeKind.COMPLETED
    assert summary["max_drift_px"] < 0.5
    assert summary["max_error_px"] < 32
    assert trace.positions[-1] != pytest.approx(trace.positions[0], abs=1e-3)


def test_a_target_that_leaves_the_image_is_a_named_outcome() -> None:
    motion = '{ kind = "step", offset_m = [2.0, 0.0, 0.0], time_s = 0.3 }'
    trace, _ = traced(shortened(3.0, target__motion=motion), images=False)
    assert trace.outcome.kind is OutcomeKind.TARGET_LOST
    assert 0.3 < trace.outcome.time < 1.5
    assert "out of sight" in trace.outcome.reason


def test_two_axis_tracking_ends_at_the_joint_limit_or_the_singularity_by_name() -> None:
    axes = {"law__axes": '["x", "y"]', "law__avoidance_axes": "[]", "law__S": "0.0"}
    ends = {}
    for sign in (1, -1):
        velocity = f"[{0.3 * sign}, 0.0, 0.0]"
        cell = shortened(6.0, target__motion__velocity_m_s=velocity, **axes)
        ends[sign] = traced(cell, images=False)[0].outcome
    assert ends[1].kind is OutcomeKind.SINGULARITY
    assert ends[-1].kind is OutcomeKind.JOINT_LIMIT
    assert "joint1" in ends[-1].reason


def test_a_driver_that_is_running_takes_a_second_run() -> None:
    cell = load_cell("puma560").replace(duration_s=0.3)
    driver = SimulatedDriver(cell, images=False)
    for _ in range(2):
        outcome = run_driver(cell, driver, (), images=False).outcome
        assert outcome.kind is OutcomeKind.COMPLETED
    assert driver.time > 0.6
