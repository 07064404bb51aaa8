"""A report in a real browser: one instant is shown in charts and film alike, in light and dark."""

from collections.abc import Iterator

import accessibility
import numpy as np
import pytest
from browser import Browser

from vergence.app.figures.chart_svg import LEFT, RIGHT, WIDTH
from vergence.app.report import report
from vergence.runtime.recording import Recording

CLOCK = "document.querySelector('.film output').textContent"
CURSORS = (
    "[...document.querySelectorAll('svg.chart[data-time] .cursor.on')]"
    ".map((one) => one.getAttribute('transform'))"
)
CHARTS = "document.querySelectorAll('svg.chart[data-time]').length"


@pytest.fixture(scope="module")
def browser(recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    page = report(recording, tmp_path_factory.mktemp("report") / "report.html")
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    browser.open(page.as_uri())
    browser.wait("document.readyState === 'complete'")
    yield browser
    browser.close()


def test_the_instant_under_the_pointer_is_shown_everywhere(browser: Browser) -> None:
    before = browser.value("document.querySelector('.film img').src")
    x, y = browser.middle("svg.chart[data-time]")
    browser.mouse("mouseMoved", x, y)
    cursors = browser.wait(CURSORS, bool)
    assert len(cursors) == browser.value(CHARTS)
    assert len(set(cursors)) == 1
    shown = float(browser.value(CLOCK).removesuffix(" s"))
    whole = float(browser.value("document.querySelector('svg.chart[data-time]').dataset.time"))
    pointed = whole * (WIDTH / 2 - LEFT) / (WIDTH - LEFT - RIGHT)  # the axes are not in the middle
    assert shown == pytest.approx(pointed, abs=0.07)  # half of the time between two images
    assert browser.value("document.querySelector('.film img').src") != before
    assert not browser.complaints


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_to_complain_of(browser: Browser, scheme: str) -> None:
    assert accessibility.complaints(browser, scheme) == []


def test_the_film_plays_to_its_end(browser: Browser) -> None:
    browser.value(
        "(() => { const s = document.querySelector('.film input'); s.value = s.max - 8;"
        "s.dispatchEvent(new Event('input')) })()"
    )
    browser.click(".film button")
    browser.wait(CLOCK, lambda text: text == "5.93 s")
    browser.wait("document.querySelector('.film button').textContent", lambda text: text == "Play")
    assert not browser.complaints


def test_no_text_of_a_chart_is_cut_off_in_the_browser(browser: Browser) -> None:
    outside = browser.value(
        "[...document.querySelectorAll('svg.chart')].flatMap((chart) => {"
        "const b = chart.getBoundingClientRect();"
        "return [...chart.querySelectorAll('text')].filter((text) => {"
        "const t = text.getBoundingClientRect();"
        "return t.left < b.left || t.right > b.right || t.top < b.top || t.bottom > b.bottom;"
        "}).map((text) => text.textContent) })"
    )
    assert outside == []


@pytest.mark.parametrize("width", [420, 700, 1280])
def test_what_explains_a_number_has_a_line_of_its_own(browser: Browser, width: int) -> None:
    browser.resize(width)
    try:
        shares = browser.value(
            "[...document.querySelectorAll('.card .note:not(:empty)')]"
            ".map((note) => note.clientWidth / note.closest('.card').clientWidth)"
        )
        assert min(shares) > 0.9
    finally:
        browser.resize(1000)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_narrow_screen_shows_text_that_can_be_read_and_no_page_wider_than_itself(
    browser: Browser, scheme: str
) -> None:
    browser.resize(420)
    try:
        assert browser.value("document.documentElement.scrollWidth") <= 420
        smallest = browser.value(
            "Math.min(...[...document.querySelectorAll('svg.chart text')]"
            ".map((text) => text.getBoundingClientRect().height))"
        )
        assert smallest > 9.0
        notes = "[...document.querySelectorAll('.card .note')].map((note) => note.clientWidth)"
        assert min(browser.value(notes)) > 200
        browser.wait("document.querySelector('figure:has(> [data-time])').tabIndex === 0")
        assert accessibility.complaints(browser, scheme) == []
        # A chart that goes on fades at the edge, until its end is reached.
        figure = "document.querySelector('figure:has(> [data-time])')"
        assert browser.value(f"getComputedStyle({figure}).maskImage") != "none"
        browser.value(f"{figure}.scrollLeft = 1000")
        browser.wait(f"getComputedStyle({figure}).maskImage === 'none'")
        browser.value(f"{figure}.scrollLeft = 0")
    finally:
        browser.resize(1000)
    browser.wait("document.querySelector('.more') === null")


@pytest.mark.parametrize(("scheme", "bright"), [("light", True), ("dark", False)])
def test_a_chart_has_the_ground_of_the_readers_scheme(
    browser: Browser, scheme: str, bright: bool
) -> None:
    media = [{"name": "prefers-color-scheme", "value": scheme}]
    browser.call("Emulation.setEmulatedMedia", features=media)
    image = browser.image("svg.chart").astype(float)
    ground = np.median(image)
    assert (ground > 200) == bright
    assert np.abs(image - ground).max() > 100  # and something can be seen on it


def test_a_page_asks_nobody_for_anything(browser: Browser) -> None:
    assert all(address.startswith(("file:", "data:")) for address in browser.addresses)
