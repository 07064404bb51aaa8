"""The loop keeps time, holds the arm when it cannot see, and ends with a reason."""

import signal

import numpy as np
import pytest
from scripted_cell import Notes, ScriptedDriver, ScriptedEyes, ScriptedLaw, flat_arm, looped

from vergence.errors import DriverSilent
from vergence.runtime import Timeouts
from vergence.signals import OutcomeKind, Sample


def changes_within(velocities: np.ndarray, acceleration: float, dt: float) -> bool:
    steps = np.diff(velocities, axis=0, prepend=np.zeros((1, velocities.shape[1])))
    return bool((abs(steps) <= acceleration * dt * (1 + 1e-9)).all())


@pytest.mark.parametrize(("inner", "outer"), [(500, 26), (500, 30), (500, 25), (1000, 60)])
@pytest.mark.parametrize("lost", [0.0, 0.4])
def test_it_turns_where_whole_periods_of_the_camera_have_passed(inner, outer, lost) -> None:
    rng, notes = np.random.default_rng(5), Notes()
    driver = ScriptedDriver(
        inner_rate_hz=inner, camera_rate_hz=outer, lose=lambda exposed: rng.random() < lost
    )
    looped(driver, rate_hz=outer, listeners=[notes]).run(2.0)
    turns = [round(record.time * inner) for record in notes.ticks]
    assert turns == [k * inner // outer for k in range(2 * outer)]
    assert driver.reads == list(range(2 * inner + 1))


@pytest.mark.parametrize("late_s", [0.002, 0.004, 0.016, 0.030])
def test_an_image_out_of_phase_is_looked_at_in_the_tick_in_which_it_arrives(late_s) -> None:
    driver, law, notes = ScriptedDriver(latency_s=late_s), ScriptedLaw(np.zeros(2)), Notes()
    looped(driver, law=law, listeners=[notes]).run(2.0)
    looked = [record for record in notes.ticks if record.observation is not None]
    assert len(looked) == len(law.asked) == 60
    for record in looked:
        assert record.time - record.observation.time == pytest.approx(late_s)
    assert len(notes.ticks) <= len(looked) + 1  # no turn between, but the first


def test_without_images_the_rates_fade_to_zero_in_the_stated_time() -> None:
    driver = ScriptedDriver(lose=lambda exposed: exposed > 0.5)
    timeouts = Timeouts(image_s=2.0, decay_s=0.15)
    looped(driver, timeouts=timeouts).run(1.5)
    velocity = driver.velocities()[:, 0]
    last, period = 0.5, 1 / 30
    time = (np.arange(len(velocity)) + 1) / 500
    expected = 0.3 * np.clip((last + period + 0.15 - (time - 1 / 500)) / 0.15, 0.0, 1.0)
    fading = (time > 0.3) & (time < 1.5)
    np.testing.assert_allclose(velocity[fading], expected[fading], atol=1e-12)


def test_a_second_loop_on_a_running_driver_starts_its_own_clock() -> None:
    driver = ScriptedDriver()
    assert looped(driver).run(1.0).kind is OutcomeKind.COMPLETED
    assert driver.time > 1.0
    notes, law = Notes(), ScriptedLaw(np.array([-0.3, 0.2]))
    outcome = looped(driver, law=law, listeners=[notes]).run(1.0)
    assert outcome.kind is OutcomeKind.COMPLETED
    assert outcome.time == pytest.approx(1.0, abs=1 / 30)
    assert notes.ticks[0].time == 0.0
    assert len(law.asked) >= 29
    assert changes_within(driver.velocities(), 8.0, 2e-3)


def test_it_completes_after_its_time_and_stops_the_arm() -> None:
    driver = ScriptedDriver()
    outcome = looped(driver).run(1.0)
    assert outcome.kind is OutcomeKind.COMPLETED
    assert outcome.time == pytest.approx(1.0, abs=1 / 30)
    velocities = driver.velocities()
    np.testing.assert_allclose(velocities[250], [0.3, -0.2])
    np.testing.assert_array_equal(velocities[-1], 0.0)
    assert changes_within(velocities, 8.0, 2e-3)


def test_the_other_arms_hold_their_place() -> None:
    driver = ScriptedDriver()
    looped(driver).run(1.0)
    np.testing.assert_array_equal(driver.positions("right"), 0.0)


@pytest.mark.parametrize("frames", [0, 1, 2, 5])
def test_the_law_sees_every_image_once_as_late_as_it_came(frames: int) -> None:
    driver = ScriptedDriver(camera_rate_hz=25, latency_s=frames / 25)
    law, notes = ScriptedLaw(np.zeros(2)), Notes()
    looped(driver, law=law, rate_hz=25, listeners=[notes]).run(2.0)
    exposed = [observation.time for observation in law.asked]
    np.testing.assert_allclose(exposed, np.arange(50 - frames) / 25)
    for record in notes.ticks:
        if record.time < frames / 25 - 1e-9:
            assert record.observation is None
            assert not record.commands
        else:
            assert record.time - record.observation.time == pytest.approx(frames / 25)
    assert len(notes.ticks) == 50


def test_without_images_it_continues_for_its_timeout_and_then_ends() -> None:
    driver = ScriptedDriver(lose=lambda exposed: exposed > 0.5)
    outcome = looped(driver, timeouts=Timeouts(image_s=0.3)).run(5.0)
    assert outcome.kind is OutcomeKind.IMAGE_LATE
    assert outcome.time == pytest.approx(0.5 + 0.3, abs=2 / 30)
    assert "no image for 0.3" in outcome.reason
    np.testing.assert_array_equal(driver.velocities()[-1], 0.0)
    assert changes_within(driver.velocities(), 8.0, 2e-3)


def test_a_camera_that_never_delivers_never_moves_the_arm() -> None:
    driver = ScriptedDriver(lose=lambda exposed: True)
    outcome = looped(driver).run(5.0)
    assert outcome.kind is OutcomeKind.IMAGE_LATE
    np.testing.assert_array_equal(driver.positions(), 0.0)


def test_single_dropped_images_do_not_end_a_run() -> None:
    rng = np.random.default_rng(34)
    driver = ScriptedDriver(lose=lambda exposed: rng.random() < 0.3)
    assert looped(driver).run(3.0).kind is OutcomeKind.COMPLETED


@pytest.mark.parametrize("reason", ["the image is empty", "left the image", "not finite"])
def test_a_lost_target_is_waited_for_in_place_and_then_slack_with_its_reason(reason) -> None:
    driver, notes = ScriptedDriver(), Notes()
    eyes = ScriptedEyes(hide=lambda exposed: reason if exposed > 1.0 else "")
    loop = looped(driver, eyes, listeners=[notes], timeouts=Timeouts(target_s=0.4))
    outcome = loop.run(5.0)
    assert outcome.kind is OutcomeKind.TARGET_LOST
    assert reason in outcome.reason
    assert outcome.time == pytest.approx(1.4, abs=2 / 30)
    braked = int(1.15 * 500)  # 0.3 rad/s at 8 rad/s² are gone in 0.04 s
    np.testing.assert_array_equal(driver.velocities()[braked:], 0.0)
    held = [record for record in notes.ticks if record.time > 1.1]
    assert held
    assert all(not record.commands for record in held)
    assert notes.events[-1][1:] == ("target lost", outcome.reason)


def test_a_target_that_comes_back_in_time_is_followed_on() -> None:
    driver, law = ScriptedDriver(), ScriptedLaw(np.array([0.1, 0.0]))
    eyes = ScriptedEyes(hide=lambda exposed: "hidden" if 0.5 < exposed < 0.65 else "")
    assert looped(driver, eyes, law).run(2.0).kind is OutcomeKind.COMPLETED
    velocities = driver.velocities()[:, 0]
    assert velocities[int(0.62 * 500)] == 0.0
    np.testing.assert_allclose(velocities[500:990], 0.1)


def test_losing_one_feature_of_two_is_an_event_not_an_end() -> None:
    notes = Notes()
    eyes = ScriptedEyes(hide_one=lambda exposed: "covered" if 0.5 < exposed < 0.8 else "")
    outcome = looped(ScriptedDriver(), eyes, listeners=[notes]).run(1.5)
    assert outcome.kind is OutcomeKind.COMPLETED
    names = [name for _, name, _ in notes.events]
    assert names == ["feature lost", "feature found"]
    assert "covered" in notes.events[0][2]


def test_a_joint_driven_against_its_limit_ends_the_run_by_name() -> None:
    driver = ScriptedDriver(arms={"left": flat_arm(reach=0.2)})
    outcome = looped(driver, law=ScriptedLaw(np.array([0.0, 1.0]))).run(5.0)
    assert outcome.kind is OutcomeKind.JOINT_LIMIT
    assert "joint2" in outcome.reason
    assert "joint1" not in outcome.reason
    positions = driver.positions()
    assert positions.max() <= 0.2
    assert positions[-1, 1] == pytest.approx(0.2, abs=1e-3)
    assert changes_within(driver.velocities(), 8.0, 2e-3)


def test_a_fault_of_the_law_is_the_outcome() -> None:
    fault = (OutcomeKind.SINGULARITY, "the elbow is straight")
    law = ScriptedLaw(np.ones(2), fault=lambda count: fault if count == 10 else None)
    driver = ScriptedDriver()
    outcome = looped(driver, law=law).run(5.0)
    assert (outcome.kind, outcome.reason) == fault
    assert len(law.asked) == 10
    np.testing.assert_array_equal(driver.velocities()[-1], 0.0)


@pytest.mark.parametrize("tick", [0, 1, 333, 800])
def test_ctrl_c_stops_the_arm_within_its_acceleration(tick: int) -> None:
    driver = ScriptedDriver(interrupt_at=tick)
    outcome = looped(driver, law=ScriptedLaw(np.array([0.4, -0.4]))).run(5.0)
    assert outcome.kind is OutcomeKind.STOPPED
    assert outcome.time == pytest.approx(tick / 500)
    velocities = driver.velocities()
    if len(velocities):
        np.testing.assert_array_equal(velocities[-1], 0.0)
        # The set-point that was on its way when the key was hit is lost: one step may be double.
        assert changes_within(velocities, 2 * 8.0, 2e-3)
        assert np.sum(abs(np.diff(velocities, axis=0)) > 8.0 * 2e-3 * (1 + 1e-9)) <= 2


@pytest.mark.parametrize("rates", [[2.0, 0.1], [1e300, -1e300], [1e9, -1e9]])
def test_whatever_the_law_says_the_joints_stay_within_their_limits(rates) -> None:
    driver = ScriptedDriver()
    looped(driver, law=ScriptedLaw(np.array(rates))).run(2.0)
    assert np.isfinite(driver.positions()).all()
    assert (abs(driver.positions()) <= 1.0).all()
    assert (abs(driver.velocities()) <= 2.0).all()
    assert changes_within(driver.velocities(), 8.0, 2e-3)


class Pressed(ScriptedDriver):
    """Ctrl-C is pressed in the middle of some ticks."""

    presses: tuple[int, ...] = ()

    def step(self, setpoints) -> None:
        if self.tick in self.presses:
            signal.raise_signal(signal.SIGINT)
        super().step(setpoints)


@pytest.mark.parametrize("tick", [0, 1, 333, 800])
def test_ctrl_c_waits_for_the_tick_that_is_under_way(tick: int) -> None:
    driver = Pressed()
    driver.presses = (tick,)
    outcome = looped(driver, law=ScriptedLaw(np.array([0.4, -0.4]))).run(5.0)
    assert outcome.kind is OutcomeKind.STOPPED
    velocities = driver.velocities()
    np.testing.assert_array_equal(velocities[-1], 0.0)
    assert changes_within(velocities, 8.0, 2e-3)  # no set-point was lost


def test_a_second_ctrl_c_does_not_keep_the_arm_from_being_braked() -> None:
    driver = Pressed()
    driver.presses = (300, 301, 302)
    assert looped(driver).run(5.0).kind is OutcomeKind.STOPPED
    np.testing.assert_array_equal(driver.velocities()[-1], 0.0)
    assert changes_within(driver.velocities(), 8.0, 2e-3)


def test_a_late_ctrl_c_frees_a_user_whose_driver_hangs(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr("vergence.runtime.interrupt.monotonic", lambda: now[0])

    class Hanging(Pressed):
        def step(self, setpoints) -> None:
            now[0] += 1.5
            super().step(setpoints)

    driver = Hanging()
    driver.presses = (300, 301, 302)
    with pytest.raises(KeyboardInterrupt):
        looped(driver).run(5.0)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


class Silent(ScriptedDriver):
    """Stops answering in some tick."""

    silent_from: int = 10**9

    def step(self, setpoints) -> None:
        if self.tick >= self.silent_from:
            raise DriverSilent("the robot said nothing for 0.5 s")
        super().step(setpoints)


@pytest.mark.parametrize("tick", [0, 333, 500])
def test_a_driver_that_falls_silent_ends_the_run_by_name(tick: int) -> None:
    driver, notes = Silent(), Notes()
    driver.silent_from = tick  # 500: while the arm is braked
    outcome = looped(driver, listeners=[notes]).run(1.0)
    assert outcome.kind is OutcomeKind.DRIVER_SILENT
    assert outcome.reason == "the robot said nothing for 0.5 s"
    assert outcome.time == pytest.approx(tick / 500)
    assert notes.events[-1][1] == "driver silent"


def test_another_law_takes_over_with_the_next_image() -> None:
    driver = ScriptedDriver()
    first, second = ScriptedLaw(np.array([0.3, 0.0])), ScriptedLaw(np.array([0.0, 0.2]))
    loop = looped(driver, law=first)
    read = driver.read

    def swapped() -> Sample:
        sample = read()
        if len(first.asked) == 15 and not second.asked and sample.frames:
            loop.replace_law(second)
        return sample

    driver.read = swapped
    loop.run(1.0)
    assert len(first.asked) == 15
    assert len(second.asked) == 15
    velocities = driver.velocities()
    np.testing.assert_allclose(velocities[200], [0.3, 0.0])
    np.testing.assert_allclose(velocities[450], [0.0, 0.2])
    assert changes_within(velocities, 8.0, 2e-3)


def test_a_run_can_be_stopped_from_inside() -> None:
    driver = ScriptedDriver()
    loop = looped(driver)
    read = driver.read

    def stopped() -> Sample:
        sample = read()
        if sample.time > 0.5:
            loop.stop()
            assert loop.stopping
        return sample

    driver.read = stopped
    outcome = loop.run(5.0)
    assert outcome.kind is OutcomeKind.STOPPED
    assert 0.5 < outcome.time < 0.54
    velocities = driver.velocities()
    np.testing.assert_array_equal(velocities[-1], 0.0)
    assert changes_within(velocities, 8.0, 2e-3)
