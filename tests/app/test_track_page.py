"""The report of `vergence track`: all it shows is measured, named with units, and in the page."""

import csv
import re
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree as ET

import accessibility
import cv2
import numpy as np
import pytest
from browser import Browser
from test_track import CAMERA, OBJ, RATE_HZ, write_footage
from test_track import pose as box_pose
from test_track_curves import COUNT, CURVES, GONE, scene
from test_track_curves import drawn as drawn_curves
from test_track_tag import image as tag_image
from test_track_tag import pose as tag_pose

from vergence.app.figures import Chart, chart_svg
from vergence.app.figures.tracked import (
    curve_chart,
    lapses,
    position_chart,
    rotation_chart,
    share_chart,
)
from vergence.app.main import main
from vergence.app.options import TrackOptions
from vergence.app.track import track
from vergence.app.tracking.curve_subject import CurveSubject
from vergence.app.tracking.track_page import write_track_page
from vergence.app.tracking.track_record import (
    TrackRecord,
    read_track,
)
from vergence.geometry import matrix_to_quaternion, so3_log
from vergence.signals import OutcomeKind

NAMES = ("box", "tag", "curves")
BOX_GONE = 12  # first image without the box


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """An object that goes, a tag that goes and comes back, and curves; not to be changed."""
    top = tmp_path_factory.mktemp("tracked")
    write_footage(top / "box", 27, empty_from=BOX_GONE)
    (top / "box.obj").write_text(OBJ)
    for name in ("tag", "curves"):
        (top / name).mkdir()
    for k in range(8):
        image = np.full((480, 640), 128, np.uint8) if k in (4, 5) else tag_image(tag_pose(k))
        cv2.imwrite(str(top / "tag" / f"{k}.png"), image)
    rng = np.random.default_rng(1)
    for k in range(COUNT):
        cv2.imwrite(str(top / "curves" / f"{k:02d}.png"), drawn_curves(scene(k), rng))
    T = box_pose()
    start = top / "start.toml"
    quaternion = matrix_to_quaternion(np.ascontiguousarray(T[:3, :3]))
    start.write_text(f"position_m = {T[:3, 3].tolist()}\nquaternion_wxyz = {quaternion.tolist()}\n")
    c = CAMERA
    options = {
        "box": {"model": str(top / "box.obj"), "start": str(start), "fx": c.fx, "fy": c.fy},
        "tag": {"tag": "apriltag_36h11:7:0.05", "fx": 700.0, "rate": 10.0},
        "curves": {"curve": list(CURVES[1::2])},
    }
    options["box"] |= {"cx": c.cx, "cy": c.cy}
    for name, own in options.items():
        track(TrackOptions(images=str(top / name), out=top / f"{name}-tracked", **own))
    return {name: top / f"{name}-tracked" for name in NAMES}


@pytest.fixture(scope="module")
def records(folders: dict[str, Path]) -> dict[str, TrackRecord]:
    return {name: read_track(folder) for name, folder in folders.items()}


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    def run(*words: object) -> int:
        monkeypatch.setattr(sys, "argv", ["vergence", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            main()
        return int(end.value.code or 0)

    return run


def charts(record: TrackRecord) -> list[tuple[str, Chart]]:
    """Return the charts of a record, each with the curve that it is about."""
    made = [(curve.title, curve_chart(record, curve)) for curve in record.curves]
    if record.pose is not None:
        kinds = (position_chart, rotation_chart, share_chart)
        made += [("", chart(record, record.pose)) for chart in kinds]
    return [(curve, chart) for curve, chart in made if chart is not None]


def column(folder: Path, table: str, name: str) -> np.ndarray:
    with (folder / table).open() as file:
        return np.array([float(row[name] or "nan") for row in csv.DictReader(file)])


@pytest.mark.parametrize("name", NAMES)
def test_the_page_holds_all_it_shows_and_links_to_files_beside_it(
    name: str, folders: dict[str, Path]
) -> None:
    page = (folders[name] / "report.html").read_text(encoding="utf-8")
    assert all(source.startswith("data:") for source in re.findall(r'src="([^"]*)"', page))
    links = {unquote(link) for link in re.findall(r'href="([^"]*)"', page)}
    table = {"curves": {"ellipses.csv", "lines.csv", "regions.csv", "marks.csv", "curves.jsonl"}}
    assert links == {"overlay.webm", "track.json"} | table.get(name, {"poses.csv", "poses.jsonl"})
    assert all((folders[name] / link).is_file() for link in links)
    assert "@import" not in page
    assert "url(" not in page


@pytest.mark.parametrize("name", NAMES)
def test_the_page_tells_the_outcome_and_shows_film_and_key_frames(
    name: str, folders: dict[str, Path], records: dict[str, TrackRecord]
) -> None:
    page = (folders[name] / "report.html").read_text(encoding="utf-8")
    outcome = records[name].outcome
    assert outcome.kind.value == ("target lost" if name == "box" else "completed")
    assert f">{outcome.kind.value}</span>after {outcome.time:.2f} s: {outcome.reason}" in page
    frames = list(folders[name].glob("frame-*.jpg"))
    assert page.count('class="film"') == 1
    assert page.count('<img src="data:image/jpeg') == 1 + len(frames)
    assert all(re.findall(r'(?:alt|aria-label)="([^"]*)"', page))


def test_every_axis_has_a_unit(records: dict[str, TrackRecord]) -> None:
    titles = {
        name: [panel.title for _, chart in charts(record) for panel in chart.panels]
        for name, record in records.items()
    }
    assert titles["box"] == [
        *("position x, right (mm)", "position y, down (mm)", "position z, forward (mm)"),
        *(f"rotation about {axis} since the first image (°)" for axis in "xyz"),
        "share of what should be visible that was found (%)",
    ]
    assert titles["tag"] == titles["box"][:6]  # a tag is found as a whole, or not
    assert titles["curves"][:5] == [
        *("centre u (px)", "centre v (px)"),
        *("longer semi-axis (px)", "shorter semi-axis (px)"),
        "angle of longer semi-axis (°)",
    ]
    assert titles["curves"][7] == "area (px²)"
    units = r" \((px|px²|mm|°|%)\)$"
    assert all(re.search(units, title) for own in titles.values() for title in own)
    assert all(chart.x_title == "time (s)" for one in records.values() for _, chart in charts(one))


def test_what_is_drawn_is_what_was_measured(
    folders: dict[str, Path], records: dict[str, TrackRecord]
) -> None:
    place = position_chart(records["tag"], records["tag"].pose)
    for panel, axis in zip(place.panels, "xyz", strict=True):
        mm, sd_mm = (1e3 * column(folders["tag"], "poses.csv", f"{c}{axis}_m") for c in ("", "sd_"))
        seen, predicted = (curve.y for curve in panel.curves)
        np.testing.assert_allclose(seen[[0, 3, 7]], mm[[0, 3, 7]], rtol=1e-6)
        assert np.isnan(seen[4:6]).all()
        np.testing.assert_allclose(predicted[3:6], mm[3:6], rtol=1e-6)  # from the last one seen
        assert np.isnan(predicted[[0, 2, 6, 7]]).all()
        [band] = panel.bands
        np.testing.assert_allclose(0.5 * (band.high - band.low), sd_mm, rtol=1e-6)
    ellipse = curve_chart(records["curves"], records["curves"].curves[0])
    for panel, name in zip(ellipse.panels, ("u_px", "v_px"), strict=False):
        px = column(folders["curves"], "ellipses.csv", name)
        np.testing.assert_allclose(panel.curves[0].y, px, rtol=1e-6)
        assert np.isnan(panel.bands[0].low).tolist() == [k in GONE for k in range(COUNT)]


def test_rotations_are_since_the_first_image_along_the_cameras_axes(
    records: dict[str, TrackRecord],
) -> None:
    record = records["box"]
    turned = np.array([panel.curves[0].y for panel in rotation_chart(record, record.pose).panels]).T
    for k in range(BOX_GONE):
        true = so3_log(box_pose(k / RATE_HZ)[:3, :3] @ box_pose()[:3, :3].T)
        np.testing.assert_allclose(turned[k], np.degrees(true), atol=0.6)


def test_what_was_not_measured_is_shaded_with_its_reason(
    folders: dict[str, Path], records: dict[str, TrackRecord]
) -> None:
    told = {name: lapses(record) for name, record in records.items()}
    predicted, lost = (lapse.shade for lapse in told["box"])
    assert (predicted.label, lost.label) == ("predicted", "lost")
    times = (BOX_GONE / RATE_HZ, 24 / RATE_HZ, 27 / RATE_HZ)
    assert (predicted.start, predicted.end) == pytest.approx(times[:2])
    assert (lost.start, lost.end) == pytest.approx(times[1:])
    assert "of edges expected found" in lost.words
    [back] = told["tag"]
    assert (back.shade.start, back.shade.end) == pytest.approx((0.4, 0.6))
    assert back.shade.words == "marker 7 is not seen"
    [gone] = told["curves"]
    assert gone.curve == "ellipse 1"
    assert (gone.shade.start, gone.shade.end) == pytest.approx((0.24, 0.36))
    assert gone.shade.words.startswith("not an ellipse")
    for name, record in records.items():
        page = (folders[name] / "report.html").read_text(encoding="utf-8")
        for lapse in told[name]:
            words = f"<b>{lapse.curve} {lapse.shade.label}".replace("<b> ", "<b>")
            assert f"{words}</b> · {lapse.shade.words}</li>" in page
        for curve, chart in charts(record):
            mine = [one for one in told[name] if one.curve == curve]
            rects = [
                one for one in drawing(chart).iter("rect") if one.attrib["class"].endswith("shade")
            ]
            reasons = [one.findtext("title") for one in rects]
            assert reasons == len(chart.panels) * [one.shade.words for one in mine]
            assert [text for _, text in chart.names] == [str(one.shade.number) for one in mine]


def drawing(chart: Chart) -> ET.Element:
    html = chart_svg(chart, "a chart")
    return ET.fromstring(html[html.index('<svg class="chart"') :])


def test_the_numbers_are_explained(folders: dict[str, Path]) -> None:
    page = (folders["box"] / "report.html").read_text(encoding="utf-8")
    rows = re.findall(r'<tr><th scope="row">(.*?)</th>.*?"note">(.*?)</td></tr>', page, re.DOTALL)
    assert {"images", "seen", "predicted", "lost", "x, to the right"} <= dict(rows).keys()
    assert all(note for _, note in rows)
    assert dict(rows)["seen"].startswith(f"{BOX_GONE} of 27 images")


def test_the_command_says_where_the_report_is_and_report_writes_it_again(
    command: Callable[..., int],
    tmp_path: Path,
    folders: dict[str, Path],
    capsys: object,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = tmp_path / "tracked"
    images = folders["curves"].parent / "curves"
    told = []

    def write(folder: Path, *page: Path | None) -> Path:
        told.append(capsys.readouterr().out)
        return write_track_page(folder, *page)

    monkeypatch.setattr("vergence.app.tracking.track_page.write_track_page", write)
    assert command("track", images, *CURVES[:2], "--no-overlay", "--out", folder) == 0
    assert "completed at 0.44 s" in told[0]  # before there is a report
    assert f"report   {folder / 'report.html'}" in capsys.readouterr().out
    first = (folder / "report.html").read_text(encoding="utf-8")
    assert "<img" not in first
    (folder / "report.html").unlink()
    assert command("report", folder) == 0
    assert (folder / "report.html").read_text(encoding="utf-8") == first
    assert command("report", folder, "--out", tmp_path / "away" / "page.html") == 0
    away = (tmp_path / "away" / "page.html").read_text(encoding="utf-8")
    for link in re.findall(r'href="([^"]*)"', away):
        assert (tmp_path / "away" / link).is_file()


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        ("poses.jsonl", lambda text: None, "poses.jsonl: no such file"),
        ("poses.jsonl", lambda text: text[:-9], "poses.jsonl, line 8: given no JSON"),
        ("poses.jsonl", lambda text: "", "poses.jsonl: given an empty file"),
        ("poses.jsonl", lambda text: text.replace("share", "shore"), "something else ('share')"),
        ("poses.jsonl", lambda text: text.replace("seen", "sawn"), "'sawn' is not a valid"),
        ("track.json", lambda text: text[:-9], "track.json: given something else"),
        ("track.json", lambda text: "[]", "track.json: given something else"),
    ],
)
def test_files_that_were_changed_are_named(
    command: Callable[..., int],
    tmp_path: Path,
    folders: dict[str, Path],
    capsys: object,
    file: str,
    change: Callable[[str], str | None],
    words: str,
) -> None:
    folder = tmp_path / "changed"
    shutil.copytree(folders["tag"], folder)
    text = change((folder / file).read_text())
    (folder / file).unlink()
    if text is not None:
        (folder / file).write_text(text)
    assert command("report", folder) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "run it again" in error


def test_tracked_footage_is_not_compared(
    command: Callable[..., int], folders: dict[str, Path], capsys: object
) -> None:
    assert command("report", folders["tag"], folders["box"]) == 2
    assert "which holds tracked footage" in capsys.readouterr().err


def test_an_answer_of_earlier_footage_does_not_stay(
    command: Callable[..., int], tmp_path: Path, folders: dict[str, Path]
) -> None:
    shutil.copytree(folders["curves"].parent / "curves", tmp_path / "torn")
    (tmp_path / "torn" / "05.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    shutil.copytree(folders["curves"], tmp_path / "out")
    assert command("track", tmp_path / "torn", *CURVES[:2], "--out", tmp_path / "out") == 2
    assert not (tmp_path / "out" / "track.json").exists()


@pytest.mark.parametrize(
    ("seen", "lost"), [(6, ""), (8, "; target lost by then: ellipse 1 last seen at 0.20 s: not an")]
)
def test_an_interrupted_track_has_a_page_of_what_there_is(
    command: Callable[..., int],
    tmp_path: Path,
    folders: dict[str, Path],
    capsys: object,
    monkeypatch: pytest.MonkeyPatch,
    seen: int,
    lost: str,
) -> None:
    write = CurveSubject.write

    def interrupted(subject: CurveSubject, name: str) -> None:
        write(subject, name)
        if name == f"{seen - 1:02d}.png":
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(CurveSubject, "write", interrupted)
    images, folder = folders["curves"].parent / "curves", tmp_path / "cut"
    assert command("track", images, *CURVES[:2], "--out", folder) == 1
    reason = f"stopped by the user after {seen} of {COUNT} images{lost}"
    assert f"stopped at {(seen - 1) / RATE_HZ:.2f} s: {reason}" in capsys.readouterr().out
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert f">stopped</span>after {(seen - 1) / RATE_HZ:.2f} s: {reason}" in page
    assert f'<td class="number">{seen}' in page
    assert (folder / f"frame-{seen - 1:06d}.jpg").is_file()  # the last image there is
    record = read_track(folder)
    assert record.outcome.kind is OutcomeKind.STOPPED
    assert len(record.time) == seen
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


@pytest.mark.parametrize("width", [1000, 420])
@pytest.mark.parametrize("name", ["box", "curves"])
def test_the_page_can_be_read_on_wide_and_narrow_screens_in_light_and_dark(
    browser: Browser, folders: dict[str, Path], name: str, width: int
) -> None:
    browser.resize(width)
    browser.open((folders[name] / "report.html").as_uri())
    browser.wait("document.readyState === 'complete' && document.querySelector('.film') !== null")
    assert browser.value("document.documentElement.scrollWidth") <= width
    outside = browser.value(
        "[...document.querySelectorAll('svg.chart')].flatMap((chart) => {"
        "const b = chart.getBoundingClientRect();"
        "return [...chart.querySelectorAll('text')].filter((text) => {"
        "const t = text.getBoundingClientRect();"
        "return t.left < b.left || t.right > b.right || t.top < b.top || t.bottom > b.bottom;"
        "}).map((text) => text.textContent) })"
    )
    assert outside == []
    if width < 640:
        browser.wait("document.querySelector('figure:has(> [data-time])').tabIndex === 0")
    for scheme in ("light", "dark"):
        assert accessibility.complaints(browser, scheme) == []
    x, y = browser.middle("svg.chart[data-time]")
    browser.mouse("mouseMoved", x, y)
    browser.wait("document.querySelectorAll('.cursor.on').length > 1")
    assert browser.value("document.querySelector('.film output').textContent") != "0.00 s"
    assert not browser.complaints
    assert all(address.startswith(("file:", "data:")) for address in browser.addresses)
