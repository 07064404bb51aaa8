"""The page of a study can be read on wide and narrow screens, in light and dark."""

from collections.abc import Iterator
from pathlib import Path

import accessibility
import pytest
from browser import Browser

from vergence.app.study_page import write_study_page
from vergence.drawing import figure
from vergence.studies import Check, Others, Spread, StudyResult
from vergence.studies.figure_files import save_figures

CHECKS = (
    Check(
        name="avoidance.min_manipulability_ratio",
        paper="remains high",
        measured=0.4761,
        unit="",
        holds=True,
        bound="at least 0.25 of the start",
    ),
    Check(
        name="headings.completed",
        paper="fails where the manipulator's base hides the object or its depth is too great",
        measured=10,
        unit="of 12",
        holds=False,
        note="90 degrees: target lost at 5.27 s: no feature found: out of sight",
        bound="at least 10 of 12 over 2.5 m, 0 and 180 degrees among them; the others hidden",
        spread=Spread(3, 2, 10.0, 8.0, 11.0),
        others=Others(
            "Share that arrives with other laws",
            (("image-based, <mean> L", "0.59"), ("position-based", "0.61")),
        ),
    ),
)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    drawn, axes = figure(7.0, 3.0)
    axes[0].plot([0, 1], [0, 1])
    figures = save_figures(folder, {"figure_01": (drawn, "A line.")})
    return write_study_page(folder, StudyResult("A study", CHECKS, figures, 0, 3), "quick")


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


@pytest.mark.parametrize("width", [1280, 420])
def test_checks_need_no_scrolling_and_their_words_no_towers(
    browser: Browser, page: Path, width: int
) -> None:
    browser.resize(width)
    browser.open(page.as_uri())
    browser.wait("document.readyState === 'complete' && document.querySelector('.checks') !== null")
    assert browser.value("document.documentElement.scrollWidth") <= width
    beyond = "(() => { const t = document.querySelector('.checks'), s = t.closest('section');"
    assert browser.value(f"{beyond} return s.scrollWidth - s.clientWidth }})()") <= 0
    lines = browser.value(
        "[...document.querySelectorAll('.checks tbody :is(th, td)')].map((cell) => "
        "[cell.textContent, cell.getBoundingClientRect().height / "
        "parseFloat(getComputedStyle(cell).lineHeight)])"
    )
    assert [text for text, height in lines if height > 6.5] == []
    for word in ("claim", "bound", "measured"):
        shown = f"document.querySelector('.checks td.{'number' if word == 'measured' else word}')"
        label = browser.value(f"getComputedStyle({shown}, '::before').content")
        assert label == (f'"{word}: "' if width == 420 else "none")
    if width == 420:
        browser.wait("document.querySelector('figure').tabIndex === 0")
    for scheme in ("light", "dark"):
        assert accessibility.complaints(browser, scheme) == []


def test_what_else_was_tried_is_a_list_below_its_check(browser: Browser, page: Path) -> None:
    browser.open(page.as_uri())
    browser.wait("document.readyState === 'complete' && document.querySelector('.remark') !== null")
    listed = "[...document.querySelectorAll('.remark li')].map((line) => line.textContent)"
    assert browser.value(listed) == ["image-based, <mean> L: 0.59", "position-based: 0.61"]
    remark = browser.value("document.querySelector('.remark').textContent")
    assert "out of sightShare that arrives with other laws:" in remark
