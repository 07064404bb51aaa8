"""Latency from a gentle motion: camera and servo, and data that do not tell."""

import json
from pathlib import Path

import numpy as np
import pytest

from vergence.app.bring_up import carried_camera
from vergence.app.options import CalibrateOptions
from vergence.cell import load_cell
from vergence.cell.written_keys import write_driver_keys
from vergence.drivers.bring_up import Excited, delay_of, excite, latencies
from vergence.errors import InputError
from vergence.places import CELLS
from vergence.simulation import SimulatedDriver

CELL = load_cell(
    "ur5",
    {"target.motion": "stationary", "inner_rate_hz": "125", "cameras.wrist.rate_hz": "15"},
)


@pytest.fixture(scope="module")
def seen() -> Excited:
    """What a simulated arm and camera show, stamped at exposure."""
    driver = SimulatedDriver(CELL)
    camera = carried_camera(CELL)
    assert camera is not None
    made = excite(driver, "ur5", camera, np.deg2rad(2.0), 5.0)
    driver.close()
    return made


@pytest.mark.parametrize("late_s", [0.0, 0.033, 0.08, 0.15])
def test_the_latency_of_stamps_is_found_to_three_milliseconds(seen: Excited, late_s: float) -> None:
    found = latencies(seen._replace(image_time=seen.image_time + late_s)).camera
    assert found.reason == ""
    assert abs(found.seconds - late_s) < 0.003
    assert found.deviation_s < 0.003


def test_the_lag_of_a_servo_is_found(seen: Excited) -> None:
    held = latencies(seen).servo.seconds
    late = np.interp(seen.time - 0.04, seen.time, seen.position)
    slower = latencies(seen._replace(position=late)).servo.seconds
    assert abs(slower - held - 0.04) < 0.003


def test_an_image_that_does_not_follow_the_arm_does_not_tell(seen: Excited) -> None:
    rng = np.random.default_rng(1)
    noise = rng.normal(size=len(seen.image_time))
    found = latencies(seen._replace(image_motion=noise)).camera
    assert np.isnan(found.seconds)
    assert "correlation" in found.reason


def test_a_motion_too_small_for_the_noise_does_not_tell() -> None:
    rng = np.random.default_rng(2)
    t = np.arange(0, 6, 0.03)
    slow = np.sin(0.3 * t)  # moves, and so slowly that its delay drowns in noise
    found = delay_of(t, slow + rng.normal(0, 0.05, len(t)), t, slow)
    assert np.isnan(found.seconds)
    assert found.reason


def test_a_signal_at_rest_or_too_short_does_not_tell() -> None:
    t = np.arange(0, 3, 0.03)
    assert "does not change" in delay_of(t, np.zeros(len(t)), t, np.sin(t)).reason
    assert "fewer than 20" in delay_of(t[:5], t[:5], t, np.sin(t)).reason


def test_the_command_says_what_to_set(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], seen: Excited
) -> None:
    from vergence import assembly
    from vergence.app.latency import latency
    from vergence.drivers import bring_up

    class Opened:
        def close(self) -> None: ...

    late = seen._replace(image_time=seen.image_time + 0.05)
    monkeypatch.setattr(assembly, "open_driver", lambda cell, named: Opened())
    monkeypatch.setattr(assembly, "rehearse", lambda cell: None)
    monkeypatch.setattr(bring_up, "excite", lambda *_: late)
    assert latency(CalibrateOptions(latency="ur5", driver="socket:localhost:9")) == 0
    said = capsys.readouterr().out
    assert "images of wrist by their stamps: " in said
    assert "stamp_latency_s = { wrist = 0.0" in said
    assert latency(CalibrateOptions(latency="ur5", driver="socket:localhost:9", as_json=True)) == 0
    assert abs(json.loads(capsys.readouterr().out)["camera"]["seconds"] - 0.05) < 0.003
    with pytest.raises(
        InputError, match="--latency: given ur5; allowed: only together with --driver"
    ):
        latency(CalibrateOptions(latency="ur5"))
    with pytest.raises(InputError, match=r"(?s)given a cell that ships .*servo_lag_s = 0\."):
        latency(CalibrateOptions(latency="ur5", driver="socket:localhost:9", write=True))


def test_what_is_found_is_written_to_the_cell_and_added_to_what_was_there(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, seen: Excited
) -> None:
    from vergence import assembly
    from vergence.app.latency import latency
    from vergence.drivers import bring_up

    class Opened:
        def close(self) -> None: ...

    late = seen._replace(image_time=seen.image_time + 0.05)
    monkeypatch.setattr(assembly, "open_driver", lambda cell, named: Opened())
    monkeypatch.setattr(assembly, "rehearse", lambda cell: None)
    monkeypatch.setattr(bring_up, "excite", lambda *_: late)
    file = tmp_path / "cell.toml"
    text = (CELLS / "ur5" / "cell.toml").read_text().replace("../puma560", str(CELLS / "puma560"))
    file.write_text(text)
    options = CalibrateOptions(latency=str(file), driver="socket:localhost:9", write=True)
    assert latency(options) == 0
    once = load_cell(file).driver
    assert once is not None
    assert abs(once.stamp_latency_s["wrist"] - 0.05) < 0.003
    assert 0.0 <= once.servo_lag_s < 0.005
    assert latency(options) == 0
    twice = load_cell(file).driver
    assert twice is not None
    assert abs(twice.stamp_latency_s["wrist"] - 0.1) < 0.006
    assert twice.servo_lag_s == once.servo_lag_s
    assert file.read_text().startswith(text.rstrip())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('driver = { kind = "mine" }\n', "written otherwise; allowed: a table"),
        ('[driver]\nkind = "ur"\n', "driver.kind: given ur; allowed: mine"),
    ],
)
def test_a_table_that_cannot_be_changed_safely_is_left_alone(
    tmp_path: Path, text: str, said: str
) -> None:
    file = tmp_path / "cell.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=said):
        write_driver_keys(file, "mine", {"servo_lag_s": 0.02})
    assert file.read_text() == text


def test_other_lines_of_the_table_stay(tmp_path: Path) -> None:
    file = tmp_path / "cell.toml"
    file.write_text('[driver] # mine\nkind = "mine"\nservo_lag_s = 0.1 # old\n\n[task]\nx = 1\n')
    write_driver_keys(file, "mine", {"servo_lag_s": 0.02})
    expected = '[driver] # mine\nservo_lag_s = 0.02\nkind = "mine"\n\n[task]\nx = 1\n'
    assert file.read_text() == expected
