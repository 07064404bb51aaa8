"""`vergence watch` of a recording: the same page, with a slider."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from watched import Watched

from vergence.app.recorded_world import RecordedWorld
from vergence.app.watch.playback import Playback
from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.runtime import Recorder, RunInfo
from vergence.runtime.recording import Recording

SMALL = {
    "cameras.wrist.resolution": "[320, 240]",
    "cameras.wrist.pixel_um": "[22.0, 26.0]",
    "duration_s": "2.0",
}
TIME = "Number.parseFloat(document.getElementById('time').textContent)"
CAPTION = "watch.images.views.get('wrist').caption.textContent"
BADGE = "document.getElementById('pause').textContent"


@pytest.fixture(scope="module")
def puma_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recorded") / "run"
    run_cell(load_cell("puma560", SMALL), [Recorder(folder, image_every=2)])
    return folder


@pytest.fixture(scope="module")
def puma_run(puma_folder: Path) -> Recording:
    return Recording.open(puma_folder)


@pytest.fixture(scope="module")
def browser(puma_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    command = Watched(str(puma_folder))
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    browser.open(command.address)
    browser.wait("document.readyState === 'complete' && typeof watch === 'object'")
    browser.wait("watch.plots.rows.length", lambda rows: rows > 100)
    yield browser
    assert browser.complaints == []
    browser.close()
    assert command.stop()["run"] == str(puma_folder)
    command.end()


class TestPlayback:
    def test_an_image_is_shown_from_when_it_came_until_the_next_one(
        self, puma_run: Recording
    ) -> None:
        playback = Playback(puma_run, None)
        taken = [time for time, _ in puma_run.jpegs("wrist")]
        for time in (0.0, 0.5, 0.77, 1.99):
            (view,) = playback.views(time)
            assert view.time <= time
            assert time - view.time < 0.14  # every second of 30 Hz, two frames late
            assert view.time == pytest.approx(min(taken, key=lambda t: abs(t - view.time)))
            assert playback.views(time)[0] is view

    def test_marks_belong_to_the_image_they_are_drawn_in(self, puma_run: Recording) -> None:
        playback = Playback(puma_run, None)
        assert playback.knows_truth
        (view,) = playback.views(1.0)
        trace = puma_run.cameras["wrist"]
        row = int(np.argmin(np.abs(trace.time - view.time)))
        np.testing.assert_array_equal(view.points.points_px, trace.points_px[row])
        assert view.header["predicted"] is not None

    def test_all_of_every_curve_is_there(self, puma_run: Recording) -> None:
        playback = Playback(puma_run, None)
        rows, names = playback.rows(), [plot.key for plot in playback.plots]
        assert names == ["error_px", "joints", "manipulability"]
        assert [row[0] for row in rows] == sorted(row[0] for row in rows)
        for column in range(1, 4):
            assert sum(bool(row[column]) for row in rows) >= 58

    def test_the_world_stands_as_it_stood(self, puma_run: Recording) -> None:
        world = RecordedWorld.of(puma_run.info)
        assert isinstance(world, RecordedWorld)
        playback = Playback(puma_run, world)
        trace = puma_run.arms["puma"]
        for time in (0.0, 1.0, 2.0):
            playback.state(time)
            row = int(np.argmin(np.abs(trace.time - time)))
            np.testing.assert_allclose(world.world.joint_position("puma"), trace.position[row])
        view_state = world.world.data.mocap_pos[0]
        np.testing.assert_allclose(view_state, puma_run.cameras["wrist"].T_world_target[-1, :3, 3])


class TestRecordedWorld:
    def test_another_cell_file_than_the_one_that_ran_is_not_shown(
        self, puma_run: Recording
    ) -> None:
        changed = replace(puma_run.info, text=puma_run.info.text + "\nseed = 9")
        assert "has changed since" in str(RecordedWorld.of(changed))

    def test_a_run_of_a_cell_as_it_is_in_its_file_is_shown(self) -> None:
        cell = load_cell("ur5")
        info = RunInfo(cell.name, cell.text, cell.seed, path=str(cell.path))
        assert isinstance(RecordedWorld.of(info), RecordedWorld)

    def test_a_cell_that_is_not_here_is_said_to_be_missing(self, recording: Recording) -> None:
        assert "not on this machine" in str(RecordedWorld.of(recording.info))


def test_it_opens_paused_at_the_start_with_the_outcome(browser: Browser) -> None:
    assert browser.value(BADGE) == "Resume"
    assert browser.value(TIME) == 0.0
    assert browser.value("document.getElementById('badge').textContent") == "completed"
    assert browser.value("document.getElementById('law').hidden")
    browser.wait(CAPTION, lambda text: "1 of 1 found" in text)


def test_a_click_on_the_slider_goes_there(browser: Browser) -> None:
    browser.click("#seek")
    browser.wait(TIME, lambda time: abs(time - 1.0) < 0.03)
    browser.wait(CAPTION, lambda text: any(f"· 0.{n}" in text for n in (8, 9)))


def test_a_click_in_a_plot_goes_there(browser: Browser) -> None:
    x, y = browser.middle("[data-plot=joints] canvas")
    browser.mouse("mousePressed", x + 90, y)
    browser.mouse("mouseReleased", x + 90, y)
    browser.wait(TIME, lambda time: 1.2 < time < 1.8)


def test_a_step_goes_to_the_next_image(browser: Browser) -> None:
    before = browser.value(TIME)
    browser.click("#step")
    after = browser.wait(TIME, lambda time: time != before)
    assert 0.0 < after - before <= 1 / 30 + 0.01


def test_it_plays_to_its_end_and_begins_again(browser: Browser) -> None:
    browser.click("#pause")
    browser.wait(f"{TIME} === Number(watch.plots.whole.toFixed(2))")
    assert float(browser.value("document.getElementById('seek').value")) == pytest.approx(
        browser.value("watch.plots.whole"), abs=0.002
    )
    browser.wait(BADGE, lambda text: text == "Resume")
    browser.click("#reset")
    browser.wait(TIME, lambda time: time == 0.0)


def test_the_arm_is_shown_in_space(browser: Browser) -> None:
    for _ in range(100):
        if browser.image("#stage").std() > 20.0:
            return
    pytest.fail("the view in space stays empty")


def test_without_the_cell_the_page_says_why_it_shows_no_space(
    run_folder: Path, tmp_path: Path
) -> None:
    command = Watched(str(run_folder))
    browser = Browser(tmp_path)
    browser.open(command.address)
    stage = "document.getElementById('stage')?.textContent ?? ''"
    browser.wait(stage, lambda text: "not on this machine" in text)
    browser.wait(
        "watch.images.views.get('wrist')?.caption.textContent ?? ''",
        lambda text: "4 of 4 found" in text,
    )
    browser.close()
    command.stop()
    command.end()
