"""Simulated cameras blur, roll, adjust and scatter as their `imaging` says."""

from pathlib import Path

import numpy as np
import pytest

from vergence.cell import Cell, load_cell
from vergence.cell.schema import CameraTable, ImagingTable
from vergence.errors import InputError
from vergence.signals import Frame, Setpoint
from vergence.simulation import SimulatedDriver
from vergence.simulation.row_weights import row_weights
from vergence.simulation.sensor import Sensor

SPOT = """<mujoco><worldbody><body name="spot">
  <geom type="box" size="0.04 0.04 0.001" rgba="1 1 1 1" contype="0" conaffinity="0"/>
</body></worldbody></mujoco>"""
ARM = """<mujoco><worldbody><body name="hand"><joint name="turn" axis="0 0 1" range="-90 90"/>
  <geom size="0.01" mass="1" pos="0 0 2" contype="0" conaffinity="0"/></body>
</worldbody></mujoco>"""
ROOM = """<mujoco><worldbody>
  <light directional="true" dir="0 0 -1" diffuse="0 0 0" ambient="0.8 0.8 0.8" specular="0 0 0"/>
</worldbody></mujoco>"""
CELL = """
name = "spot"
duration_s = 1.0
[scene]
model = "room.xml"
[arms.hand]
model = "arm.xml"
body = "hand"
start_deg = [0.0]
[cameras.eye]
arm = "hand"
position_m = [0.0, 0.0, 1.0]
rotation_rpy_deg = [180.0, 0.0, 0.0]
resolution = [160, 120]
focal_px = [200, 200]
rate_hz = 25.0
noise_grey = 0.0
[target]
model = "spot.xml"
position_m = [-0.15, -0.2, 0.0]
rotation_rpy_deg = [0.0, 0.0, 20.0]   # askew, so that the jagged edges average out
features = [[0.0, 0.0, 0.0]]
motion = { kind = "line", velocity_m_s = [0.5, 0.0, 0.0], distance_m = 0.4 }
[task]
arm = "hand"
camera = "eye"
[law]
kind = "optimal_tracking"
"""
SPEED_PX_S = 100.0


def spot(folder: Path, imaging: dict[str, object] | str | None, **camera: object) -> Cell:
    for name, text in (("spot", SPOT), ("arm", ARM), ("room", ROOM)):
        (folder / f"{name}.xml").write_text(text)
    (folder / "cell.toml").write_text(CELL)
    return load_cell(folder).replace(cameras={"eye": {"imaging": imaging, **camera}})


def film(cell: Cell, until_s: float = 0.3, images: bool = True) -> list[tuple[float, Frame]]:
    """Return when each frame arrived, and the frame; the arm rests."""
    driver = SimulatedDriver(cell, images)
    joints = driver.read().joints
    at_rest = {name: Setpoint(arm.position, 0 * arm.position) for name, arm in joints.items()}
    arrived = []
    try:
        while driver.time < until_s:
            driver.step(at_rest)
            arrived += [(driver.time, frame) for frame in driver.read().frames]
    finally:
        driver.close()
    return arrived


def place(image: np.ndarray) -> tuple[float, float, float]:
    """Return the centroid of the light, and its variance along a row."""
    light = image.astype(float)
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    x, y = (float((light * axis).sum() / light.sum()) for axis in (u, v))
    return x, y, float((light * (u - x) ** 2).sum() / light.sum())


def test_a_camera_without_imaging_and_one_with_an_ideal_table_take_the_same_images(
    tmp_path: Path,
) -> None:
    pairs = zip(film(spot(tmp_path, None)), film(spot(tmp_path, "ideal")), strict=True)
    for (at, frame), (also_at, same) in pairs:
        assert at == also_at
        np.testing.assert_array_equal(frame.image, same.image)


def test_motion_blur_widens_what_moves_about_its_true_place(tmp_path: Path) -> None:
    fast = {"motion": {"kind": "line", "velocity_m_s": [1.0, 0.0, 0.0], "distance_m": 0.4}}
    sharp, blurred = (
        film(spot(tmp_path, {"exposure_s": exposure}).replace(target=fast))[4][1]
        for exposure in (0.0, 0.04)
    )
    assert sharp.time == blurred.time
    wider = place(blurred.image)[2] - place(sharp.image)[2]
    assert wider == pytest.approx((2 * SPEED_PX_S * 0.04) ** 2 / 12, rel=0.06)
    for frame in (sharp, blurred):
        u, v = frame.truth.points_px[0]
        assert place(frame.image)[:2] == pytest.approx((u, v), abs=0.1)


def test_a_row_of_a_rolling_shutter_is_seen_at_its_own_time(tmp_path: Path) -> None:
    frame = film(spot(tmp_path, {"readout_s": 0.04}))[4][1]
    u, v = frame.truth.points_px[0]
    later = 0.04 * (v / 119 - 0.5)
    assert later > 0.008
    assert place(frame.image)[:2] == pytest.approx((u + SPEED_PX_S * later, v), abs=0.1)


def test_an_image_arrives_no_sooner_than_its_shutter_has_closed(tmp_path: Path) -> None:
    arrived = film(spot(tmp_path, {"exposure_s": 0.02, "readout_s": 0.01}))
    for at, frame in arrived:
        assert at == pytest.approx(frame.time + 0.016)  # half of both, at the next tick of 2 ms
    late = film(spot(tmp_path, {"exposure_s": 0.02}, latency_frames=1))
    assert all(at == pytest.approx(frame.time + 0.04) for at, frame in late if frame.time > 0)


def test_what_rests_is_as_sharp_as_through_a_fast_shutter(tmp_path: Path) -> None:
    at_rest = {"motion": {"kind": "stationary"}}
    slow, fast = (
        film(spot(tmp_path, {"exposure_s": time, "readout_s": time}).replace(target=at_rest))[4][1]
        for time in (0.04, 0.0)
    )
    np.testing.assert_array_equal(slow.image, fast.image)


def test_rows_weigh_moments_as_an_integral_over_their_exposure_does() -> None:
    imaging = ImagingTable(exposure_s=0.004, readout_s=0.01)
    moments = np.linspace(-0.007, 0.007, 8)
    weights = row_weights(moments, 11, imaging)
    np.testing.assert_allclose(weights.sum(axis=0), 1.0)
    for row, middle in enumerate(np.linspace(-0.005, 0.005, 11)):
        t = middle + 0.004 * ((np.arange(4000) + 0.5) / 4000 - 0.5)
        brute = [np.interp(t, moments, np.eye(8)[j]).mean() for j in range(8)]
        np.testing.assert_allclose(weights[:, row], brute, atol=1e-5)
    rolling = row_weights(moments, 11, ImagingTable(readout_s=0.014))
    np.testing.assert_allclose(moments @ rolling, np.linspace(-0.007, 0.007, 11), atol=1e-12)


def sensor(noise_grey: float = 0.0, **imaging: object) -> Sensor:
    table = CameraTable(focal_px=(100, 100), noise_grey=noise_grey, imaging=imaging)
    return Sensor((120, 160), table, np.random.default_rng(1))


def test_shot_noise_has_the_variance_of_counted_electrons() -> None:
    counting = sensor(noise_grey=2.0, full_well_electrons=1000)
    for grey in (20, 100, 200):
        image = counting.read(np.full((120, 160), grey, np.uint8)).astype(float)
        assert image.mean() == pytest.approx(grey, abs=0.3)
        assert image.var() == pytest.approx(255 / 1000 * grey + 4.0 + 1 / 12, rel=0.05)


def test_vignetting_takes_its_share_of_the_light_in_the_corners() -> None:
    image = sensor(vignetting=0.4).read(np.full((120, 160), 200, np.uint8))
    assert image[0, 0] == image[-1, -1] == 120
    assert image[59, 79] == 200
    assert image[59, 0] == pytest.approx(200 - 80 * 0.64, abs=1)


def test_automatic_exposure_reaches_its_grey_level_with_its_lag() -> None:
    adjusting = sensor(auto_exposure_s=0.2, auto_exposure_grey=100)
    bright, dark = (np.full((120, 160), grey, np.uint8) for grey in (200, 50))
    assert adjusting.read(bright).mean() == pytest.approx(100, abs=1)
    means = [adjusting.read(dark, settled=False).mean() for _ in range(30)]
    assert means[0] == pytest.approx(25, abs=1)  # still at the gain of the bright scene
    assert means[6] == pytest.approx(100 * 0.25 ** np.exp(-1), rel=0.03)  # 0.2 s at 30 Hz
    assert means[-1] == pytest.approx(100, rel=0.03)


def test_compression_loses_more_the_lower_its_quality() -> None:
    image = np.random.default_rng(2).integers(0, 256, (15, 20)).astype(np.uint8).repeat(8, 0)
    image = image.repeat(8, 1)
    lost = [
        float(np.abs(sensor(jpeg_quality=q).read(image).astype(float) - image).mean())
        for q in (100, 60, 10)
    ]
    assert lost[0] < lost[1] < lost[2]
    assert lost[0] < 1.0


@pytest.mark.parametrize("images", [True, False])
def test_dropped_images_are_a_share_drawn_by_the_seed(tmp_path: Path, images: bool) -> None:
    cell = spot(tmp_path, {"dropped": 0.4}, rate_hz=250.0)
    until = 1.0 if not images else 0.2
    times = [frame.time for _, frame in film(cell, until, images)]
    assert times == [frame.time for _, frame in film(cell, until, images)]
    share = 1 - len(times) / (until * 250)
    assert 0.2 < share < 0.6


def test_the_same_seed_gives_the_same_images(tmp_path: Path) -> None:
    cell = spot(tmp_path, "real_camera", noise_grey=1.5)
    first, second = (film(cell, 0.15) for _ in range(2))
    for (_, frame), (_, same) in zip(first, second, strict=True):
        np.testing.assert_array_equal(frame.image, same.image)


def test_keys_given_beside_the_preset_replace_its_values(tmp_path: Path) -> None:
    cell = spot(tmp_path, {"kind": "real_camera", "readout_s": 0.0})
    imaging = cell.cameras["eye"].imaging
    assert imaging.readout_s == 0.0
    assert imaging.exposure_s == 0.008
    assert cell.replace(seed=3).cameras["eye"].imaging == imaging


@pytest.mark.parametrize(
    ("imaging", "key", "allowed"),
    [
        ("realcamera", "imaging", "ideal, real_camera"),
        ({"exposure_s": 0.05}, "imaging.exposure_s", "at most 0.04, the time between images"),
        ({"readout_s": 0.05}, "imaging.readout_s", "at most 0.04, the time between images"),
        ({"vignetting": 1.0}, "imaging.vignetting", "less than 1"),
        ({"jpeg_quality": 101}, "imaging.jpeg_quality", "at most 100"),
        ({"shutter": 1}, "imaging.shutter", "exposure_s"),
        (3, "imaging", "a table"),
    ],
)
def test_what_cannot_be_imaging_is_refused_by_key(
    tmp_path: Path, imaging: object, key: str, allowed: str
) -> None:
    with pytest.raises(InputError) as refused:
        spot(tmp_path, imaging)
    assert refused.value.key == f"cameras.eye.{key}"
    assert allowed in refused.value.allowed
