"""`vergence watch` in a real browser: the page shows a cell that runs, and steers it."""

import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import accessibility
import numpy as np
import pytest
from browser import Browser
from watched import Watched

from vergence.runtime.recording import Recording

SMALL = ("resolution=[320, 240]", "pixel_um=[22.0, 26.0]")  # of puma560: the same view, quicker
STILL = "target.motion={kind = 'stationary'}"

ROWS = "watch.plots.rows.length"
TIME = "watch.plots.rows.at(-1)?.[0] ?? -1"
ERROR = "watch.plots.rows.at(-1)?.[1][0]"
VIEW = "watch.images.views.get('wrist')"
# Where the tracked point is in the window, and the target in the view in space.
POINT = (
    f"(() => {{ const v = {VIEW}, b = v.canvas.getBoundingClientRect();"
    "const [x, y] = v.header.points[0];"
    "return [b.left + (x + 0.5) * b.width / 320, b.top + (y + 0.5) * b.height / 240] })()"
)
BOX = (
    f"(() => {{ const b = {VIEW}.canvas.getBoundingClientRect();"
    "return [b.left, b.top, b.width, b.height] })()"
)
TARGET = (
    "(() => { const s = watch.scene, o = s.outline, b = s.stage.getBoundingClientRect();"
    "const m = [0, 1].map((k) => o.reduce((sum, p) => sum + p[k], 0) / o.length);"
    "const f = s.focal(b.height);"
    "return [b.left + b.width / 2 + f * m[0], b.top + b.height / 2 + f * m[1]] })()"
)

# Looks at the page in every frame from its beginning, and after it has lost its connection.
LOOKING = """
if (window === top) {
  window.seen = { connecting: 0, early: 0, apart: [] };
  const shown = () => getComputedStyle(watch.scene.frame).visibility === "visible";
  const badge = () => document.getElementById("badge").textContent;
  window.WebSocket = class extends WebSocket {
    constructor(address) {
      super(address);
      window.line = this;
      this.addEventListener("close", () => setTimeout(() => seen.apart.push([badge(), shown()])));
    }
  };
  requestAnimationFrame(function look() {
    requestAnimationFrame(look);
    if (!window.watch?.scene.frame) return;
    const connected = ["/state", "/ui"].every((path) => watch.scene.lines.has(path));
    seen.connecting += !connected;
    seen.early += shown() && !connected;
  });
}
"""
SHOWN = "watch.scene.frame && getComputedStyle(watch.scene.frame).visibility === 'visible'"


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    folder = tmp_path_factory.mktemp("watch")
    settings = [*(f"cameras.wrist.{text}" for text in SMALL), STILL]
    options = [part for text in settings for part in ("--set", text)]
    command = Watched("puma560", "--out", str(folder / "run"), *options)
    yield command
    command.end()


@pytest.fixture(scope="module")
def browser(watched: Watched, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    browser.open(watched.address)
    browser.wait("document.readyState === 'complete' && typeof watch === 'object'")
    browser.wait(ROWS, lambda rows: rows > 5)
    yield browser
    browser.close()


def resume(browser: Browser) -> None:
    if browser.value("document.getElementById('badge').textContent") == "paused":
        browser.click("#pause")
    browser.wait("document.getElementById('badge').textContent", lambda text: text == "running")


def drag_in_space(
    browser: Browser, start: Callable[[], tuple[float, float]], by: tuple[float, float]
) -> None:
    """Drag in the view in space; again if it was hidden meanwhile, as on a busy computer."""
    browser.value(
        "window.hidden ??= (() => { const count = { times: 0 }, { stage } = watch.scene;"
        "new MutationObserver(() => { count.times += stage.classList.contains('lost') })"
        ".observe(stage, { attributes: true }); return count })(); 0"
    )
    for _ in range(20):
        browser.wait(SHOWN)
        before = browser.value("hidden.times")
        x, y = start()
        browser.drag((x, y), (x + by[0], y + by[1]), steps=12)
        if browser.value("hidden.times") == before:
            return
    pytest.fail("the view in space was hidden during each of 20 drags")


def settled(browser: Browser) -> None:
    browser.wait(ERROR, lambda error: error is not None and error < 1.0)


def test_it_says_that_only_this_machine_can_reach_it(watched: Watched) -> None:
    assert "http://localhost:" in watched.said
    assert "Only this machine" in watched.said


def test_the_page_shows_a_running_cell(browser: Browser) -> None:
    assert browser.value("document.getElementById('cell').textContent") == "puma560"
    before = browser.value(TIME)
    browser.wait(TIME, lambda time: time > before + 0.5)
    titles = browser.value(
        "[...document.querySelectorAll('.plot figcaption')].map(c => c.innerText)"
    )
    assert [
        part
        for title in titles
        for part in re.findall(r"\((?:px|±1 = limits|0 = singular)\)", title)
    ]
    assert "joint1" in titles[1]
    assert "joint6" in titles[1]
    browser.wait(f"{VIEW}.caption.textContent", lambda text: "1 of 1 found" in text)


def test_the_view_in_space_shows_the_arm_and_moves_with_the_mouse(browser: Browser) -> None:
    browser.wait(
        "watch.scene.frame.contentDocument?.getElementById('canvas')?.width ?? 0", lambda w: w > 0
    )
    browser.wait("watch.scene.outline !== null")
    corner = browser.value(
        "(() => { const b = watch.scene.stage.getBoundingClientRect();"
        "return [b.left + 25, b.bottom - 25] })()"
    )
    looks = [browser.image("#stage")]
    for _ in range(100):  # until the model has come
        looks.append(browser.image("#stage"))
        if looks[-1].std() > 20.0:
            break
    before = looks[-1].astype(float)
    assert before.std() > 20.0
    outline = browser.value("JSON.stringify(watch.scene.outline)")
    drag_in_space(browser, lambda: corner, (80, -20))
    browser.wait("JSON.stringify(watch.scene.outline)", lambda text: text != outline)
    changed = np.abs(browser.image("#stage").astype(float) - before).max(axis=2) > 30
    assert changed.mean() > 0.02


def test_the_view_in_space_is_hidden_while_it_is_not_connected(browser: Browser) -> None:
    script = browser.call("Page.addScriptToEvaluateOnNewDocument", source=LOOKING)
    browser.reload()
    browser.wait("typeof seen === 'object' && typeof watch === 'object'")
    browser.wait(SHOWN)
    assert browser.value("seen.connecting") > 0
    assert browser.value("seen.early") == 0
    browser.value("line.close()")
    assert browser.wait("seen.apart", lambda apart: len(apart)) == [["not connected", False]]
    browser.wait(SHOWN)
    browser.wait("document.getElementById('badge').textContent", lambda text: text == "running")
    browser.call("Page.removeScriptToEvaluateOnNewDocument", **script)
    browser.reload()
    browser.wait("typeof seen === 'undefined' && typeof watch === 'object'")
    browser.wait(ROWS, lambda rows: rows > 5)


def test_the_badge_and_the_view_in_space_agree_that_nothing_comes(
    browser: Browser, watched: Watched
) -> None:
    browser.wait(SHOWN)
    os.kill(watched.pid, signal.SIGSTOP)
    try:
        browser.wait("document.getElementById('badge').textContent", lambda t: t == "no answer")
        browser.wait(f"!({SHOWN})")
        time.sleep(2.0)  # the viewer draws its notice
        assert not browser.value(SHOWN)
    finally:
        os.kill(watched.pid, signal.SIGCONT)
    browser.wait("document.getElementById('badge').textContent", lambda text: text == "running")
    browser.wait(SHOWN)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_to_complain_of(browser: Browser, scheme: str) -> None:
    assert accessibility.complaints(browser, scheme) == []


def test_a_narrow_window_shows_the_whole_page(browser: Browser) -> None:
    browser.resize(390)
    browser.wait("document.documentElement.scrollWidth", lambda width: width <= 390)
    choice = "document.getElementById('law-choice')"
    browser.value(f"{choice}.add(new Option('x'.repeat(80), 'long'))")
    assert browser.value("document.documentElement.scrollWidth") <= 390
    browser.value(f"{choice}.remove({choice}.length - 1)")
    browser.resize(1000)


def test_every_control_is_reached_by_the_keyboard_and_has_a_name(browser: Browser) -> None:
    controls = (
        "[...document.querySelectorAll('button, input, select')]"
        ".filter((e) => !e.disabled && e.checkVisibility({visibilityProperty: true}))"
    )
    count = browser.value(f"{controls}.length")
    assert count > 20
    browser.value("document.activeElement.blur()")
    reached = set()
    for _ in range(2 * count):
        browser.key("Tab")
        index = browser.value(f"{controls}.indexOf(document.activeElement)")
        reached.add(index)
    assert reached >= set(range(count))


def test_the_limits_that_shape_the_motion_are_named(browser: Browser) -> None:
    text = browser.value("document.getElementById('limits').textContent")
    assert text.startswith("Limits that shape the motion now: ")


def test_marks_are_drawn_where_the_points_are(browser: Browser) -> None:
    browser.click("#pause")
    for layer in ("windows", "predicted", "desired"):
        browser.click(f"[data-layer={layer}]")
    x, y, u, v = browser.value(
        f"(() => {{ const v = {VIEW}, c = v.canvas; let n = 0, x = 0, y = 0;"
        "const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
        "for (let i = 0; i < d.length; i += 4) {"
        "const w = d[i + 1] - Math.max(d[i], d[i + 2]); if (w < 4) continue;"
        "n += w; x += w * (i / 4 % c.width + 0.5); y += w * (Math.floor(i / 4 / c.width) + 0.5) }"
        "return [x / n * 320 / c.width - 0.5, y / n * 240 / c.height - 0.5,"
        "...v.header.points[0]] })()"
    )
    assert [x, y] == pytest.approx([u, v], abs=0.1)
    for layer in ("windows", "predicted", "desired"):
        browser.click(f"[data-layer={layer}]")
    resume(browser)


def test_a_click_pauses_and_a_step_advances_by_one_image(browser: Browser) -> None:
    browser.click("#pause")
    browser.wait("document.getElementById('badge').textContent", lambda text: text == "paused")
    before = browser.value(TIME)
    browser.click("#step")
    after = browser.wait(TIME, lambda time: time > before)
    assert after - before == pytest.approx(1 / 30, abs=0.003)
    assert browser.value("watch.plots.rows.at(-2)[0]") == before
    resume(browser)
    browser.wait(TIME, lambda time: time > after + 0.1)


def test_gain_and_law_change_while_it_runs(browser: Browser) -> None:
    def choose(name: str) -> None:
        browser.value(
            f"(() => {{ const s = document.getElementById('law-choice'); s.value = {name!r};"
            "s.dispatchEvent(new Event('change')) })()"
        )
        browser.wait(
            "document.getElementById('settings').textContent + watch.law.choice.value",
            lambda text: name in text,
        )

    def turn(value: str) -> None:
        browser.value(
            "(() => { const f = document.querySelector('.knob[data-key=gain] input');"
            f"f.value = {value!r}; f.dispatchEvent(new Event('change')) }})()"
        )

    log = "document.getElementById('log').innerText"
    choose("image_based")
    assert "1/s" in browser.wait("document.querySelector('.knob[data-key=gain]')?.innerText ?? ''")
    turn("3.5")
    browser.wait("document.getElementById('settings').textContent", lambda t: "law.gain=3.5" in t)
    turn("-1")
    browser.wait(log, lambda text: "refused" in text and "law.gain" in text)
    field = "document.querySelector('.knob[data-key=gain] input')"
    browser.wait(f"{field}.value", lambda value: value == "3.5")
    told = browser.value("document.getElementById('log').children.length")
    turn("3.5")  # as it is already: nothing changes
    browser.value(f"{field}.focus()")
    browser.key("ArrowUp")
    browser.wait("document.getElementById('settings').textContent", lambda t: "law.gain=3.93" in t)
    browser.wait("document.getElementById('log').children.length", lambda count: count == told + 1)
    assert browser.value(f"{field}.ariaDescription").endswith("above 0, up to 100 1/s")
    slider = "document.querySelector('.knob[data-key=gain] [type=range]')"
    browser.wait(f"{slider}.ariaValueText", lambda text: text == "3.93 1/s")
    before = browser.value(TIME)
    browser.wait(TIME, lambda time: time > before + 0.5)  # and the old one goes on
    assert "law changed" in browser.value(log)
    settled(browser)
    browser.click(".knob[data-key=gain] .undo")
    browser.wait("document.getElementById('settings').textContent", lambda t: "gain" not in t)


def test_the_arm_follows_the_target_that_the_mouse_drags_in_an_image(
    browser: Browser,
) -> None:
    settled(browser)
    joints = browser.value("watch.plots.rows.at(-1)[2]")
    browser.middle(".image canvas")
    start = tuple(browser.value(POINT))
    browser.drag(start, (start[0] + 60, start[1]))
    browser.wait(
        "Math.max(...watch.plots.rows.map((row) => row[1][0] ?? 0))",
        lambda most: most > 3.0,
    )
    settled(browser)
    moved = np.subtract(browser.value("watch.plots.rows.at(-1)[2]"), joints)
    assert np.abs(moved).max() > 0.005
    assert browser.value("document.getElementById('let-go').textContent").startswith("Let it move")


def test_the_target_can_be_dragged_in_space_too(browser: Browser) -> None:
    settled(browser)
    browser.middle("#stage")
    joints = browser.value("watch.plots.rows.at(-1)[2]")
    drag_in_space(browser, lambda: tuple(browser.value(TARGET)), (15, 0))
    browser.wait(
        "watch.plots.rows.at(-1)[2]",
        lambda now: float(np.abs(np.subtract(now, joints)).max()) > 0.005,
    )
    settled(browser)


def test_points_that_are_clicked_are_tracked_from_there(browser: Browser) -> None:
    browser.click("#pick")
    browser.wait("document.getElementById('badge').textContent", lambda text: text == "paused")
    (u0, v0), *_ = browser.value(f"{VIEW}.header.points")
    browser.middle(".image canvas")
    left, top, width, height = browser.value(BOX)
    meant = []
    for u, v in ((u0, v0), (u0 + 24, v0), (u0, v0 + 20)):
        x = round(left + (u + 0.5) * width / 320)  # the mouse is at whole pixels of the window
        y = round(top + (v + 0.5) * height / 240)
        browser.click_at(x, y)
        meant.append(((x - left) * 320 / width - 0.5, (y - top) * 240 / height - 0.5))
    picked = browser.value("watch.picking.points")
    np.testing.assert_allclose(picked, meant, atol=1e-3)
    browser.click("#track-points")
    seen = browser.wait(f"{VIEW}?.header?.points", lambda points: points and len(points) == 3)
    np.testing.assert_allclose(seen, picked, atol=1.5)
    before = browser.value(TIME)
    browser.wait(TIME, lambda time: time > before + 0.5)
    assert browser.value("document.getElementById('badge').textContent") == "running"
    np.testing.assert_allclose(browser.value(f"{VIEW}.header.desired"), picked, atol=1e-3)
    settled(browser)


def test_a_goal_is_taken_where_the_arm_is(browser: Browser, watched: Watched) -> None:
    browser.click("#take-goal")
    text = browser.wait(
        "document.getElementById('log').innerText", lambda text: "goal taken" in text
    )
    goal = Path(re.search(r"--goal (\S+)", text)[1])
    assert {goal.name, "goal-1.toml", "goal-1.camera.yaml"} <= {
        path.name for path in goal.parent.iterdir()
    }


def test_a_restart_begins_from_the_start_with_the_changed_law_until_that_is_reset(
    browser: Browser,
) -> None:
    def restart() -> None:
        before = browser.wait(TIME, lambda time: time > 5.0)
        browser.click("#reset")
        browser.wait(TIME, lambda time: 0 < time < before)
        browser.wait("document.getElementById('badge').textContent", lambda text: text == "running")

    settings = "document.getElementById('settings').textContent"
    hidden = "document.getElementById('law-changed').hidden"
    restart()  # takes up the cell's own task, after points were picked
    browser.wait(hidden)
    browser.value(
        "(() => { const f = document.querySelector('.knob[data-key=Q] input');"
        "f.value = 4e-6; f.dispatchEvent(new Event('change')) })()"
    )
    browser.wait(settings, lambda text: "law.Q=4e-06" in text)
    restart()
    assert "law.Q=4e-06" in browser.value(settings)
    assert "also stay when the run is restarted" in browser.value(
        "document.getElementById('law-changed').innerText"
    )
    browser.click("#own-law")
    browser.wait(hidden)
    assert browser.value(settings) == ""
    assert browser.value("watch.law.law.knobs.every((knob) => knob.value === knob.own)")


def test_nothing_is_fetched_from_elsewhere_and_nothing_goes_wrong(
    browser: Browser, watched: Watched
) -> None:
    browser.value("0")  # hears what has been said meanwhile
    own = (watched.address, "blob:", "data:", "about:")
    assert [address for address in browser.addresses if not address.startswith(own)] == []
    assert browser.complaints == []


def test_ctrl_c_stops_the_arm_though_it_is_paused_and_leaves_a_recording(
    browser: Browser, watched: Watched
) -> None:
    browser.click("#pause")
    browser.wait("document.getElementById('badge').textContent", lambda text: text == "paused")
    answer = watched.stop()
    assert answer["outcome"]["kind"] == "stopped"
    third = Path(answer["run"])
    assert third.name == "run-4"
    first, picked, last = (
        Recording.open(third.with_name(name)) for name in ("run", "run-2", "run-4")
    )
    assert picked.cameras["wrist"].points_px.shape[1] == 3
    for recording in (first, picked, last):
        assert recording.complete
        assert np.abs(recording.arms["puma"].velocity[-1]).max() < 0.5
    assert "law changed" in {event.name for event in first.events}
    moved = first.cameras["wrist"].T_world_target[[0, -1], :3, 3]
    assert np.linalg.norm(moved[1] - moved[0]) > 0.02
