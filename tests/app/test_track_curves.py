"""`vergence track --curve`: curves through footage, their values, their losses, and bad input."""

import csv
import json
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from real_images import IMAGES, PACKAGE
from vergence.app.main import main

sys.path.append(str(Path(__file__).parents[1] / "vision"))
from curve_images import drawn

Track = Callable[..., int]
GONE = range(6, 9)  # images without the ellipse
COUNT = 12


def centre(k: int) -> np.ndarray:
    return np.array([70.0 + 2.0 * k, 60.0 + 1.5 * k])


def scene(k: int) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """An ellipse that is gone for a while, a slanted edge, a rectangle and a round mark."""
    x, y = centre(k)

    def inside(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        ellipse = ((u - x) / 40) ** 2 + ((v - y) / 25) ** 2 < float(k not in GONE)
        half_plane = (u - 270 - k) + 0.2 * (v - 120) > 0
        rectangle = (np.abs(u - 180) < 30) & (np.abs(v - 190 + k) < 15)
        mark = (u - 40) ** 2 + (v - 200) ** 2 < 36
        return ellipse | half_plane | rectangle | mark

    return inside


@pytest.fixture(scope="module")
def footage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("curves")
    rng = np.random.default_rng(1)
    for k in range(COUNT):
        cv2.imwrite(str(folder / f"{k:02d}.png"), drawn(scene(k), rng))
    return folder


@pytest.fixture
def track(footage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Track:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def run(*words: str, images: Path = footage) -> int:
        monkeypatch.setattr(sys, "argv", ["vergence", "track", str(images), *words])
        with pytest.raises(SystemExit) as end:
            main()
        code = end.value.code
        return code if isinstance(code, int) else 0

    return run


CURVES = (
    *("--curve", "ellipse:70,60"),
    *("--curve", "line:285,45,260,170"),
    *("--curve", "region:180,190"),
    *("--curve", "mark:42,201"),
)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def test_values_are_those_of_the_curves_and_what_was_lost_is_found_again(
    track: Track, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert track(*CURVES, "--json", "--out", "here") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["outcome"]["kind"] == "completed"
    assert (answer["frames"], answer["seen"]) == (COUNT, COUNT - len(GONE))
    assert [one["seen"] for one in answer["curves"]] == [COUNT - len(GONE), COUNT, COUNT, COUNT]
    ellipses = rows(tmp_path / "here" / "ellipses.csv")
    for k, row in enumerate(ellipses):
        assert row["found"] == ("false" if k in GONE else "true")
        assert bool(row["reason"]) == (row["u_px"] == "") == (k in GONE)
    assert ellipses[6]["reason"].startswith("not an ellipse")
    for k in set(range(COUNT)) - set(GONE):
        truth = (*centre(k), 40.0, 25.0, 0.0)
        columns = ("u_px", "v_px", "semi_major_px", "semi_minor_px", "angle_rad")
        for name, true in zip(columns, truth, strict=True):
            deviation = float(ellipses[k][f"sd_{name}"])
            assert abs(float(ellipses[k][name]) - true) < 4.0 * deviation < 0.4
    theta = np.arctan(0.2)  # to the left of the sense in which the points are given
    for k, row in enumerate(rows(tmp_path / "here" / "lines.csv")):
        assert float(row["theta_rad"]) == pytest.approx(theta, abs=2e-3)
        offset = (270 + k) * np.cos(theta) + 120 * np.sin(theta)
        assert float(row["rho_px"]) == pytest.approx(offset, abs=0.3)
    for k, row in enumerate(rows(tmp_path / "here" / "regions.csv")):
        assert float(row["v_px"]) == pytest.approx(190 - k, abs=0.1)
        assert float(row["area_px2"]) == pytest.approx(1800, rel=0.02)
        assert float(row["angle_rad"]) == pytest.approx(0.0, abs=0.01)
    for row in rows(tmp_path / "here" / "marks.csv"):
        assert float(row["u_px"]) == pytest.approx(40.0, abs=0.15)
    lines = (tmp_path / "here" / "curves.jsonl").read_text().splitlines()
    first = json.loads(lines[0])["curves"]
    assert [one["kind"] for one in first] == ["ellipse", "line", "region", "mark"]
    assert np.shape(first[0]["covariance"]) == (5, 5)


def test_the_overlay_shows_what_is_found_and_where_it_was_lost(
    track: Track, tmp_path: Path
) -> None:
    assert track("--curve", "ellipse:70,60", "--out", "here") == 0
    frames = sorted(path.name for path in (tmp_path / "here").glob("frame-*.jpg"))
    assert {"frame-000000.jpg", "frame-000006.jpg", "frame-000009.jpg", "frame-000011.jpg"} <= set(
        frames
    )
    film = cv2.VideoCapture(str(tmp_path / "here" / "overlay.webm"))
    assert film.read()[1].shape == (240, 320, 3)
    film.release()

    def reddish(name: str) -> int:
        blue, _, red = cv2.split(cv2.imread(str(tmp_path / "here" / name)).astype(int))
        return int((red - blue > 100).sum())

    assert reddish("frame-000000.jpg") == 0
    assert reddish("frame-000006.jpg") > 50


def test_a_curve_that_is_not_there_at_the_end_is_lost(
    track: Track, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(2)
    (tmp_path / "ends").mkdir()
    for k in range(8):
        cv2.imwrite(str(tmp_path / "ends" / f"{k}.png"), drawn(scene(k), rng))
    words = ("--curve", "ellipse:70,60", "--curve", "region:180,190", "--no-overlay")
    assert track(*words, images=tmp_path / "ends") == 1
    told = capsys.readouterr().out
    assert "target lost" in told
    assert "ellipse 1 last seen at 0.20 s: not an ellipse" in told
    assert "region 2: found in 8 of 8 images" in told


@pytest.mark.parametrize(
    ("sequence", "curves", "count"),
    [
        ("ellipse-1", ("ellipse:180,130",), 50),  # which turns and is partly out of the image
        ("line", ("line:120,10,310,245",), 33),
        ("mire-2", ("ellipse:160,213", "mark:86,179", "mark:216,167", "region:92,266"), 501),
    ],
)
def test_curves_in_real_images_are_followed_to_the_end(
    track: Track, capsys: pytest.CaptureFixture[str], sequence: str, curves: tuple[str, ...],
    count: int,
) -> None:  # fmt: skip
    assert (IMAGES / sequence).is_dir(), f"install {PACKAGE}"
    words = [word for curve in curves for word in ("--curve", curve)]
    assert track(*words, "--json", "--no-overlay", images=IMAGES / sequence) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["frames"], answer["seen"]) == (count, count)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--curve", "70,60"), "allowed: KIND:U,V,U,V,… in pixels"),
        (("--curve", "elipse:70,60"), "kind elipse; allowed: ellipse, line, mark, region (did you"),
        (("--curve", "ellipse:70"), "KIND:U,V"),
        (("--curve", "ellipse:70,x"), "KIND:U,V"),
        (("--curve", "ellipse:70,nan"), "KIND:U,V"),
        (("--curve", "ellipse:1,1,2,2,3,3"), "3 points; allowed: for ellipse: one point inside"),
        (("--curve", "line:1,1"), "1 point; allowed: for line: two points"),
        (("--curve", "line:9,9,9,9"), "two points of a line at one place"),
        (("--curve", "mark:1,1,2,2"), "2 points; allowed: for mark: one"),
        (("--curve", "region:400,60"), "point 400,60 outside the image; allowed: 0,0 to 319,239"),
        (("--curve", "ellipse:200,130"), "in the first image; allowed: for ellipse: one p"),
        (("--curve", "mark:120,120"), "mark:120,120: no "),
        (("--curve", "mark:40,200", "--tag", "apriltag_36h11:7:0.05"), "only without --tag"),
        (("--curve", "mark:40,200", "--tag", "a:1:1"), "--curve: given mark:40,200; allowed: only"),
        (("--curve", "mark:40,200", "--rate", "1e300"), "--rate: given 1e+300; allowed: from 0.00"),
        (("--curve", "mark:40,200", "--rate", "1e-300"), "--rate: given 1e-300; allowed: from 0.0"),
        (("--curve", "mark:40,200", "--model", "a.obj"), "only without --curve"),
        (("--curve", "mark:40,200", "--fx", "500"), "--fx: given 500.0; allowed: only without"),
        (("--curve", "mark:40,200", "--jolt", "30"), "--jolt: given 30.0; allowed: only with --cu"),
        (("--curve", "ellipse:70,60", "--jolt", "1"), "--jolt: given 1.0; allowed: "),
        (("--curve", "ellipse:70,60", "--share", "2"), "--share: given 2.0; allowed: "),
    ],
)
def test_bad_curves_are_named_with_what_is_allowed(
    track: Track, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], message: str
) -> None:
    assert track(*words, "--out", "here") == 2
    assert message in capsys.readouterr().err
