"""`vergence watch` in a real browser, without a mouse, and over a line that is cut."""

from collections.abc import Iterator

import numpy as np
import pytest
from browser import Browser
from cut_line import CutLine
from watched import Watched

VIEW = "watch.images.views.get('wrist')"
ERROR = "watch.plots.rows.at(-1)?.[1][0]"
JOINTS = "watch.plots.rows.at(-1)?.[2]"
BADGE = "document.getElementById('badge').textContent"
LOG = "document.getElementById('log').innerText"
SETTINGS = (
    "cameras.wrist.resolution=[320, 240]",
    "cameras.wrist.pixel_um=[22.0, 26.0]",
    "target.motion={kind = 'stationary'}",
)


@pytest.fixture(scope="module")
def line(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CutLine]:
    folder = tmp_path_factory.mktemp("watch")
    options = [part for text in SETTINGS for part in ("--set", text)]
    command = Watched("puma560", "--out", str(folder / "run"), *options)
    with CutLine(command.port) as line:
        yield line
    command.end()


@pytest.fixture(scope="module")
def browser(line: CutLine, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    browser.open(line.address)
    browser.wait("document.readyState === 'complete' && typeof watch === 'object'")
    browser.wait(ERROR, lambda error: error is not None and error < 1.0)
    yield browser
    assert browser.complaints == []
    browser.close()


def test_arrow_keys_move_and_turn_the_target_and_the_log_says_by_how_much(
    browser: Browser,
) -> None:
    joints = browser.value(JOINTS)
    browser.value("document.querySelector('.image canvas').focus()")
    for _ in range(8):
        browser.press("ArrowRight")
    browser.release("ArrowRight")
    moved = browser.wait(LOG, lambda text: "target moved" in text)
    assert "mm" in moved
    assert "°" not in moved
    browser.wait(JOINTS, lambda now: np.abs(np.subtract(now, joints)).max() > 0.005)
    for _ in range(8):
        browser.press("ArrowUp", alt=True)
    browser.release("ArrowUp")
    browser.wait(LOG, lambda text: "°" in text)
    browser.wait(ERROR, lambda error: error is not None and error < 1.0)


def test_points_are_picked_without_a_mouse(browser: Browser) -> None:
    browser.value("document.getElementById('pick').focus()")
    browser.press("Enter", "\r")
    browser.release("Enter")
    browser.wait(BADGE, lambda text: text == "paused")
    assert browser.value("document.activeElement.closest('.image')?.dataset.camera") == "wrist"
    u, v = browser.value("[319 / 2, 239 / 2]")
    for key, shift in (("ArrowLeft", True), ("ArrowUp", False), ("ArrowUp", False)):
        browser.press(key, shift=shift)
        browser.release(key)
    browser.press("Enter", "\r")
    browser.release("Enter")
    np.testing.assert_allclose(browser.value("watch.picking.points"), [[u - 10, v - 2]])
    browser.press("Enter", "\r")
    browser.release("Enter")
    assert browser.value("watch.picking.points") == []
    browser.press("Escape")
    browser.value("document.getElementById('pause').click()")
    browser.wait(BADGE, lambda text: text == "running")


def test_the_view_in_space_turns_with_the_arrow_keys(browser: Browser) -> None:
    browser.wait("watch.scene.outline !== null")
    before = browser.value("watch.scene.outline")
    browser.value("document.getElementById('stage').focus()")
    for key in ("ArrowLeft", "ArrowUp", "+"):
        browser.press(key)
        browser.release(key)
    browser.wait(
        "watch.scene.outline",
        lambda now: len(now) != len(before) or np.abs(np.subtract(now, before)).max() > 0.02,
    )


def test_after_a_cut_page_and_view_in_space_come_back_by_themselves(
    browser: Browser, line: CutLine
) -> None:
    browser.wait("watch.scene.lines.size", lambda size: size == 2)
    assert line.cut("/state") > 0
    browser.wait("watch.scene.lost")
    browser.wait("!watch.scene.lost && watch.scene.lines.size === 2")
    line.open = False
    line.cut()
    browser.wait(BADGE, lambda text: text == "not connected")
    assert browser.value("watch.scene.lost")
    assert browser.value("['parts', 'transport'].every((id) => document.getElementById(id).inert)")
    line.open = True
    browser.wait(BADGE, lambda text: text == "running")
    assert not browser.value("document.querySelectorAll('[inert]').length")
    browser.wait("!watch.scene.lost && watch.scene.lines.size === 2")
