"""A gain that is high near the goal and low far from it, wherever an objective has a gain."""

from pathlib import Path

import numpy as np
import pytest
from servo_scene import CAMERA, SQUARE, START, in_view, puma, seen

import vergence as vg
from vergence.app.watch.knobs import knobs
from vergence.cell import load_cell
from vergence.control import (
    AdaptiveGain,
    ImageBased,
    PointPose,
    Posture,
    PseudoInverse,
    QuadraticProgram,
    Servo,
)
from vergence.errors import InputError
from vergence.features import Centre, Points
from vergence.geometry import so3_log

GAIN = AdaptiveGain(near=4.0, far=0.7, slope=400.0)
ARM = puma()
WORLD = in_view(ARM, START, SQUARE)
TOML = "{ near = 4.0, far = 0.7, slope = 30.0 }"


def features_at(q: np.ndarray) -> Points:
    points, depth = seen(ARM, q, WORLD)
    return Points(CAMERA.normalize(points), depth)


def test_it_is_near_at_the_goal_falls_by_slope_and_ends_at_far() -> None:
    at = [GAIN.at(np.array([-x, 0.5 * x])) for x in np.linspace(0.0, 0.2, 200)]
    assert at[0] == 4.0
    assert at[-1] == pytest.approx(0.7, abs=1e-4)
    assert (np.diff(at) < 0).all()
    step = 1e-7
    assert (GAIN.at(np.array([step])) - 4.0) / step == pytest.approx(-400.0, rel=1e-4)
    assert AdaptiveGain(near=2.0, far=2.0, slope=1.0).at(np.ones(3)) == 2.0


def centre_error(q: np.ndarray) -> np.ndarray:
    now, goal = features_at(q), features_at(START)
    return Centre(now.points, now.depth_m).error(Centre(goal.points, goal.depth_m))


def pose_error(q: np.ndarray) -> np.ndarray:
    T = np.linalg.inv(ARM.forward_kinematics(START)) @ ARM.forward_kinematics(q)
    return np.concatenate((T[:3, 3], so3_log(T[:3, :3].copy())))


@pytest.mark.parametrize(
    ("objective", "error"),
    [
        (ImageBased(gain=GAIN, feature=Centre, interaction="current"), centre_error),
        (PointPose(gain=GAIN), pose_error),
    ],
)
def test_the_error_decays_at_far_when_large_and_at_near_when_small(objective, error) -> None:
    servo = Servo(ARM, CAMERA, objective, solver=PseudoInverse())
    goal, q, dt = features_at(START), START + 0.08, 0.002
    sizes = []
    for _ in range(3000):
        sizes.append(np.abs(error(q)).max())
        q = q + dt * servo.rates(features_at(q), goal, q)
    rates, largest = -np.diff(np.log(sizes)) / dt, np.array(sizes[:-1])
    assert largest[0] > 0.06
    assert largest[-1] < 1e-4
    np.testing.assert_allclose(rates[largest > 0.05], 0.7, rtol=0.03)
    np.testing.assert_allclose(rates[largest < 1e-4], 4.0, rtol=0.02)


@pytest.mark.parametrize("solver", [PseudoInverse(), QuadraticProgram()])
@pytest.mark.parametrize("shift", [0.3, 0.02, 1e-4])
def test_a_tick_is_that_of_a_constant_gain_of_the_same_value(solver, shift: float) -> None:
    """Limits, and the damping against noise, therefore hold as with any gain."""
    goal, q = features_at(START), START + shift
    now = features_at(q)
    same = GAIN.at(now.points - goal.points)
    rates = []
    for gain in (GAIN, same):
        servo = Servo(ARM, CAMERA, ImageBased(gain=gain), solver=solver)
        rates.append(servo.rates(now, goal, q))
        assert (np.abs(rates[-1]) <= ARM.rate_max + 1e-9).all()
    np.testing.assert_array_equal(*rates)
    assert np.abs(rates[0]).max() > 0


def test_a_posture_is_neared_by_it_too() -> None:
    state = Servo(ARM, CAMERA, ImageBased())._main.state_of(
        features_at(START), features_at(START), START
    )
    asked = [
        Posture(gain=GAIN, strength=1.0, position=tuple(START - away)).quadratic(state).g
        for away in (1e-6, 1.0)
    ]
    np.testing.assert_allclose(asked[0], -4.0e-6, rtol=1e-3)
    np.testing.assert_allclose(asked[1], -0.7, rtol=1e-3)


def test_a_cell_file_takes_it_alone_and_in_a_stack_and_the_live_page_turns_it() -> None:
    cell = load_cell("eye_to_hand", {"law.gain": TOML})
    assert cell.law.objective.gain == AdaptiveGain(near=4.0, far=0.7, slope=30.0)
    assert cell.replace(duration_s=1.0).law == cell.law
    assert cell.replace(law={"gain": {"near": 6.0}}).law.objective.gain.near == 6.0
    assert cell.replace(law={"gain": 2.0}).law.objective.gain == 2.0
    shown = {knob["key"]: knob for knob in knobs(cell.law)}
    assert (shown["gain.near"]["value"], shown["gain.near"]["high"]) == (4.0, 100.0)
    assert {"gain.far", "gain.slope"} <= shown.keys()
    assert "gain" not in shown
    stack = (
        f"{{ objectives = [{{ kind = 'image_based', gain = {TOML} }}, {{ kind = 'posture' }}] }}"
    )
    first, second = load_cell("eye_to_hand", {"law": stack}).law.terms
    assert (first.objective.gain, second.objective.gain) == (cell.law.objective.gain, 1.0)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("{ near = 0.4, far = 0.7, slope = 3 }", "law.gain.far: given 0.7; allowed: at most near"),
        ("{ near = 4, far = 0, slope = 3 }", "law.gain.far: given 0; allowed: greater than 0"),
        ("{ near = 4, far = 1, slope = 0 }", "law.gain.slope: given 0; allowed: greater than 0"),
        ("{ near = 400, far = 1, slope = 1 }", "law.gain.near: given 400; allowed: at most 100"),
        ("{ near = 4, far = 1 }", "law.gain.slope: missing"),
        ("{ near = 4, far = 1, slope = 3, fra = 1 }", "law.gain.fra: given a key"),
        ("'high'", "law.gain: given high; allowed: a number, or { near, far, slope }"),
        ("-1", "law.gain: given -1; allowed: greater than 0"),
    ],
)
def test_one_that_cannot_be_used_is_named_with_file_and_key(value: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        load_cell("eye_to_hand", {"law.gain": value})
    assert said in str(caught.value)
    assert Path(caught.value.source).name == "cell.toml"


def test_a_run_with_it_is_faster_and_no_faster_at_its_peak() -> None:
    times, peaks = [], []
    for gain in (1.3, {"near": 4.0, "far": 0.7, "slope": 30.0}):
        law = {"gain": gain}
        run = vg.run("eye_to_hand", images=False, law=law, duration_s=6.0)
        camera = run.cameras["stand"]
        off = np.flatnonzero(camera.error_px.max(axis=1) > 1.0)[-1]
        times.append(camera.time[off + 1])
        moved = np.diff(camera.T_world_target[:, :3, 3], axis=0)
        peaks.append((np.linalg.norm(moved, axis=1) / np.diff(camera.time)).max())
    assert peaks[1] < 1.01 * peaks[0]
    assert times[1] < 0.5 * times[0]


def test_laws_that_share_it_are_compared_in_the_loop() -> None:
    law = {"gain": {"near": 4.0, "far": 0.7, "slope": 30.0}}
    errors = [
        run.final_error_px
        for changed in (law, {"gain": 0.7})
        for run in vg.compare(
            "eye_to_hand", ["own", "image_based"], starts=1, law=changed, duration_s=2.0
        ).runs
    ]
    assert max(errors[:2]) < 0.5 * min(errors[2:])
