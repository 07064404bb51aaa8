"""A rendered image shows things where the camera says they project: pixel centres at integers."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from vergence.cell import Cell, load_cell
from vergence.errors import InputError
from vergence.geometry import transform_points
from vergence.simulation import SimulatedDriver
from vergence.simulation.build import intrinsics

MODEL = """<mujoco><worldbody><body name="spot">
  <geom type="{kind}" size="{size}" rgba="1 1 1 1" contype="0" conaffinity="0"/>
</body></worldbody></mujoco>"""
ARM = """<mujoco><worldbody><body name="hand"><joint name="turn" axis="0 0 1" range="-90 90"/>
  <geom size="0.01" mass="1" pos="0 0 2" contype="0" conaffinity="0"/></body>
</worldbody></mujoco>"""
# A black room: nothing but the spot sends light to the camera.
ROOM = """<mujoco><worldbody>
  <light directional="true" dir="0 0 -1" diffuse="0 0 0" ambient="1 1 1" specular="0 0 0"/>
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
rotation_rpy_deg = [180.0, 0.0, {turn}]
resolution = [{width}, {height}]
focal_px = [{fx}, {fy}]
principal_px = [{cx}, {cy}]
distortion = {distortion}
noise_grey = 0.0
[target]
model = "spot.xml"
position_m = [{x}, {y}, 0.0]
features = [[0.0, 0.0, 0.0]]
[task]
arm = "hand"
camera = "eye"
[law]
kind = "optimal_tracking"
"""
LENSES: dict[str, dict[str, object]] = {
    "central": {"width": 640, "height": 480, "fx": 700, "fy": 700, "cx": 319.5, "cy": 239.5},
    "off the middle": {
        "width": 640,
        "height": 480,
        "fx": 700,
        "fy": 620,
        "cx": 250.25,
        "cy": 300.5,
    },
    "barrel": {
        "width": 640,
        "height": 480,
        "fx": 420,
        "fy": 430,
        "cx": 310.5,
        "cy": 250.5,
        "distortion": [-0.28, 0.08, 1e-3, -2e-3, 0.0],
    },
    "cushion": {
        "width": 640,
        "height": 480,
        "fx": 700,
        "fy": 700,
        "cx": 319.5,
        "cy": 239.5,
        "distortion": [0.3, 0.1],
    },
    "odd size": {"width": 333, "height": 251, "fx": 400, "fy": 480, "cx": 190.0, "cy": 101.75},
}


def spot_cell(folder: Path, geom: dict[str, str], **values: object) -> Cell:
    (folder / "spot.xml").write_text(MODEL.format(**geom))
    (folder / "arm.xml").write_text(ARM)
    (folder / "room.xml").write_text(ROOM)
    (folder / "cell.toml").write_text(CELL.format(**{"distortion": []} | values))
    return load_cell(folder)


def first_image(cell: Cell) -> tuple[np.ndarray, np.ndarray]:
    """The first image as float, and where the spot's middle truly projects."""
    driver = SimulatedDriver(cell)
    try:
        frame = driver.first_frame("eye")
        assert frame.image is not None
        assert frame.truth is not None
        return frame.image.astype(np.float64), frame.truth.points_px[0]
    finally:
        driver.close()


def centroid(image: np.ndarray) -> np.ndarray:
    weight = image - image.min()
    assert weight.sum() > 0
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    return np.array([(weight * u).sum(), (weight * v).sum()]) / weight.sum()


def disc_centroid(cell: Cell, radius: float) -> np.ndarray:
    """Where the middle of a disc's image is: not quite where the disc's middle projects."""
    driver = SimulatedDriver(cell, images=False)
    try:
        truth, camera = driver.first_frame("eye").truth, driver.cameras["eye"]
    finally:
        driver.close()
    assert truth is not None
    angles = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    rim = radius * np.column_stack((np.cos(angles), np.sin(angles), np.zeros(720)))
    T_camera_target = np.linalg.inv(truth.T_world_camera) @ truth.T_world_target
    m = cv2.moments(camera.project(transform_points(T_camera_target, rim)).astype(np.float32))
    return np.array([m["m10"], m["m01"]]) / m["m00"]


@pytest.mark.parametrize("lens", LENSES)
def test_a_disc_is_drawn_around_the_place_it_projects_to(tmp_path: Path, lens: str) -> None:
    rng = np.random.default_rng(36)
    disc = {"kind": "cylinder", "size": "0.02 0.0001"}
    gaps = []
    for x, y in rng.uniform(-0.1, 0.1, (8, 2)):
        cell = spot_cell(tmp_path, disc, turn=0.0, x=x, y=y, **LENSES[lens])
        image, _ = first_image(cell)
        gaps.append(centroid(image) - disc_centroid(cell, 0.02))
    # Whole pixels are in the disc or not, which shifts a disc so small by 0.06 px rms.
    assert np.abs(np.mean(gaps, axis=0)).max() < 0.06
    assert np.std(gaps) < 0.08


@pytest.mark.parametrize("turn", [30.0, 90.0, -135.0])
def test_a_turned_camera_turns_the_image_with_it(tmp_path: Path, turn: float) -> None:
    disc = {"kind": "cylinder", "size": "0.02 0.0001"}
    cell = spot_cell(tmp_path, disc, turn=turn, x=0.08, y=-0.05, **LENSES["off the middle"])
    image, true_px = first_image(cell)
    np.testing.assert_allclose(centroid(image), true_px, atol=0.1)


def test_edges_of_a_box_fall_between_the_right_pixels(tmp_path: Path) -> None:
    box = {"kind": "box", "size": "0.05 0.04 0.0001"}
    lens = LENSES["central"]
    cell = spot_cell(tmp_path, box, turn=0.0, x=0.0, y=0.0, **lens)
    image, middle = first_image(cell)
    bright = image > image.max() / 2
    rows, columns = np.flatnonzero(bright.any(axis=1)), np.flatnonzero(bright.any(axis=0))
    half = np.array([0.05, 0.04]) * 700 / (1.0 - 0.0001)
    # Pixel k covers k - 0.5 to k + 0.5: it is bright where its centre lies in the box.
    assert columns[0] == np.ceil(middle[0] - half[0])
    assert columns[-1] == np.floor(middle[0] + half[0])
    assert rows[0] == np.ceil(middle[1] - half[1])
    assert rows[-1] == np.floor(middle[1] + half[1])


def test_a_line_across_a_distorted_image_bends_as_the_lens_bends_it(tmp_path: Path) -> None:
    rod = {"kind": "box", "size": "0.005 2 0.0001"}
    cell = spot_cell(tmp_path, rod, turn=0.0, x=0.45, y=0.0, **LENSES["barrel"])
    image, _ = first_image(cell)
    lens = intrinsics(cell.cameras["eye"])
    for y in np.linspace(-0.4, 0.4, 9):
        u, v = lens.project(np.array([[0.45, y, 1.0]]))[0]
        row = image[round(v)]
        row = row - np.median(row)
        near = lens.project(np.array([[0.45, lens.normalize([[u, round(v)]])[0, 1], 1.0]]))[0]
        assert (np.arange(640) * row).sum() / row.sum() == pytest.approx(near[0], abs=0.3)


def test_points_in_a_distorted_image_are_where_the_features_are_drawn(tmp_path: Path) -> None:
    disc = {"kind": "cylinder", "size": "0.012 0.0001"}
    for x, y in ((0.6, 0.4), (-0.6, 0.4), (0.6, -0.4)):  # near the corners of the image
        cell = spot_cell(tmp_path, disc, turn=0.0, x=x, y=y, **LENSES["barrel"])
        image, true_px = first_image(cell)
        assert np.abs(centroid(image) - true_px).max() < 0.1


def test_a_lens_that_folds_the_image_is_refused_with_its_key(tmp_path: Path) -> None:
    disc = {"kind": "cylinder", "size": "0.02 0.0001"}
    lens = LENSES["barrel"] | {"distortion": [-2.0]}
    with pytest.raises(InputError, match=r"cameras\.eye\.distortion.*one-to-one"):
        SimulatedDriver(spot_cell(tmp_path, disc, turn=0.0, x=0.0, y=0.0, **lens), images=False)


def test_a_camera_that_looks_past_the_floor_sees_the_sky() -> None:
    cell = load_cell("eye_to_hand").replace(cameras={"stand": {"noise_grey": 0.0}})
    driver = SimulatedDriver(cell)
    try:
        first, second = (driver.first_frame("stand").image for _ in range(2))
    finally:
        driver.close()
    assert first is not None
    assert second is not None
    assert first[0].min() > 150  # above the floor's edge
    # It is drawn again, once, after the first image without it; nothing else differs.
    np.testing.assert_array_equal(first, second)


def test_behind_a_room_without_a_sky_it_is_black(tmp_path: Path) -> None:
    disc = {"kind": "cylinder", "size": "0.02 0.0001"}
    image, _ = first_image(spot_cell(tmp_path, disc, turn=0.0, x=0.0, y=0.0, **LENSES["central"]))
    assert image[0].max() == 0.0
