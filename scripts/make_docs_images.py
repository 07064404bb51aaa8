"""Make the images of the documentation's guides; the report's needs Chromium on the path.

It reads the cell of docs/guide/own-arm.md from that page, so image and page go together.
"""

import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from vergence.simulation import choose_renderer

choose_renderer()

import cv2  # noqa: E402
import mujoco  # noqa: E402
import numpy as np  # noqa: E402

from vergence.app.recorded_images import camera_images  # noqa: E402
from vergence.app.robot_film import robot_film  # noqa: E402
from vergence.assembly import run_cell  # noqa: E402
from vergence.cell import load_cell  # noqa: E402
from vergence.places import built_in_cells  # noqa: E402
from vergence.runtime.recording import Recording  # noqa: E402
from vergence.signals import Setpoint  # noqa: E402
from vergence.simulation import SimulatedDriver  # noqa: E402
from vergence.simulation.world import World  # noqa: E402

DOCS = Path(__file__).parents[1] / "docs"
VERGENCE = Path(sys.executable).with_name("vergence")
SLOW = ("gantry", "photograph")  # cells whose task has an end, which is what their image shows
GREEN, ORANGE, WHITE = (115, 158, 0), (0, 159, 230), (255, 255, 255)  # BGR


class Snapshot:
    """Keeps the tick nearest to an instant that has an image."""

    def __init__(self, time: float) -> None:
        self.time, self.record = time, None

    def begin(self, info): ...

    def tick(self, record):
        if record.time <= self.time and record.sample.frames and record.observation:
            self.record = record

    def event(self, time, name, text): ...

    def close(self, outcome, summary): ...


def own_arm() -> None:
    """The arm of the page from outside, and what its camera sees."""
    with tempfile.TemporaryDirectory() as folder:
        page = (DOCS / "guide" / "own-arm.md").read_text()
        for name, text in re.findall(r":caption: xarm/(\S+)\n(.*?)```", page, re.DOTALL):
            Path(folder, name).write_text(text)
        cell = load_cell(folder)
        snapshot = Snapshot(2.0)
        run_cell(cell, [snapshot])
        both = np.hstack([outside(cell, snapshot.record), inside(snapshot.record)])
    cv2.imwrite(str(DOCS / "images" / "own-arm.jpg"), cv2.resize(both, None, fx=0.7, fy=0.7))


def own_object() -> None:
    """The page's footage as `vergence track` draws the object into it, and its report."""
    page = (DOCS / "guide" / "own-object.md").read_text()
    with tempfile.TemporaryDirectory() as folder:
        for name, text in re.findall(r":caption: (wedge/\S+)\n(.*?)```", page, re.DOTALL):
            file = Path(folder, name)
            file.parent.mkdir(exist_ok=True)
            file.write_text(text)
        footage = re.search(r"```python\n(.*?)```", page, re.DOTALL)[1]
        subprocess.run([sys.executable, "-c", footage], cwd=folder, check=True)
        track = re.search(r"vergence (track \S+ --model .*)", page)[1].split()
        subprocess.run([VERGENCE, *track], cwd=folder, check=True)
        shutil.copy(Path(folder, "tracked", "frame-000014.jpg"), DOCS / "images/own-object.jpg")
        screenshot(f"file://{folder}/tracked/report.html", (1100, 1195), "track-report.jpg")


def gallery(*names: str) -> None:
    """Built-in cells, from outside and through the camera of their task; all without names."""
    for name in names or built_in_cells():
        with tempfile.TemporaryDirectory() as folder:
            run = ("run", name, "--set", "duration_s=60" if name in SLOW else "duration_s=6")
            subprocess.run([VERGENCE, *run, "--out", folder], stdout=subprocess.DEVNULL)
            recording = Recording.open(folder)
            seen = camera_images(recording, recording.info.task_camera).film[-1]
            both = [decoded(robot_film(recording)[-1].jpeg), decoded(seen.jpeg)]
        pair = np.hstack([cv2.resize(image, (400, 300), interpolation=3) for image in both])
        path = str(DOCS / "images" / "cells" / f"{name}.jpg")
        cv2.imwrite(path, pair, [cv2.IMWRITE_JPEG_QUALITY, 84])


def two_blocks() -> None:
    """Two objects that hide each other, as both fixed cameras of that cell see them."""
    with tempfile.TemporaryDirectory() as folder:
        run = ("run", "two_blocks", "--set", "duration_s=9.6", "--out", folder)
        subprocess.run([VERGENCE, *run], stdout=subprocess.DEVNULL)
        recording = Recording.open(folder)
        both = []
        for camera, time in (("left", 4.5), ("right", 9.4)):
            film = camera_images(recording, camera).film
            both.append(decoded(min(film, key=lambda frame: abs(frame.time - time)).jpeg))
    path = str(DOCS / "images" / "two-blocks.jpg")
    cv2.imwrite(path, np.hstack(both), [cv2.IMWRITE_JPEG_QUALITY, 84])


DEFECTS = {  # what each panel of the image is called, and its `imaging`; stronger than usual
    "ideal": None,
    "exposure_s = 0.025": {"exposure_s": 0.025},
    "readout_s = 0.033": {"readout_s": 0.033},
    "auto_exposure_s = 0.3": {"auto_exposure_s": 0.3},
    "vignetting = 0.7": {"vignetting": 0.7},
    "full_well_electrons = 500": {"full_well_electrons": 500},
    "jpeg_quality = 10": {"jpeg_quality": 10},
    "real_camera": "real_camera",
}


def imaging() -> None:
    """What each key of a camera's `imaging` does to an image of a fast board."""
    panels = []
    for title, table in DEFECTS.items():
        blind = [[0.1, 0.38]] if "auto" in title else []  # to which the exposure adjusts
        image = film_of({"imaging": table, "blind_s": blind})[280:, :300]
        panel = cv2.cvtColor(cv2.resize(image, None, fx=1.2, fy=1.2), cv2.COLOR_GRAY2BGR)
        cv2.rectangle(panel, (0, 0), (359, 24), (40, 36, 32), -1)
        cv2.putText(panel, title, (8, 17), cv2.FONT_HERSHEY_SIMPLEX, 0.5, WHITE, 1, cv2.LINE_AA)
        panels.append(cv2.copyMakeBorder(panel, 3, 3, 3, 3, 0, value=(128, 128, 128)))
    grid = np.vstack([np.hstack(panels[i : i + 2]) for i in range(0, len(panels), 2)])
    cv2.imwrite(str(DOCS / "images" / "imaging.jpg"), grid, [cv2.IMWRITE_JPEG_QUALITY, 82])


def film_of(camera: dict):
    """Return the last image of the Puma's camera at rest, just after it was blind."""
    motion = {"kind": "line", "velocity_m_s": [0.4, 0.0, 0.0], "distance_m": 1.0}
    cell = load_cell("puma560").replace(cameras={"wrist": camera}, target={"motion": motion})
    driver = SimulatedDriver(cell)
    arms = driver.read().joints
    at_rest = {name: Setpoint(arm.position, 0 * arm.position) for name, arm in arms.items()}
    frames = []
    try:
        while driver.time < 0.5:
            driver.step(at_rest)
            frames += driver.read().frames
    finally:
        driver.close()
    return next(frame.image for frame in frames if frame.time > 0.39)


def decoded(jpeg: bytes):
    return cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)


def outside(cell, record):
    """Render the cell as it stood."""
    world = World(cell)
    frame = record.sample.frames[-1]
    world.place_arm("xarm", frame.joints["xarm"])
    world.move_target(frame.truth.T_world_target)
    world.update()
    world.model.vis.global_.offwidth, world.model.vis.global_.offheight = 640, 480
    renderer = mujoco.Renderer(world.model, 480, 640)
    view = mujoco.MjvCamera()
    view.lookat, view.distance, view.azimuth, view.elevation = [0.2, 0, 0.27], 1.15, 130, -18
    renderer.update_scene(world.data, view)
    image = renderer.render()[..., ::-1].copy()
    image[image.sum(axis=2) == 0] = (244, 240, 236)
    return image


def inside(record):
    """Draw tracked and desired points into the camera's image."""
    image = cv2.cvtColor(record.sample.frames[-1].image, cv2.COLOR_GRAY2BGR)
    for points_px, color, kind in (
        (record.reference.points_px, ORANGE, cv2.MARKER_CROSS),
        (record.observation.views[-1].points_px, GREEN, cv2.MARKER_SQUARE),
    ):
        for u, v in points_px:
            place = (round(u), round(v))
            cv2.drawMarker(image, place, WHITE, kind, 26, 5, cv2.LINE_AA)
            cv2.drawMarker(image, place, color, kind, 24, 2, cv2.LINE_AA)
    return image


def report() -> None:
    """The head of the report of the tutorial's first run."""
    with tempfile.TemporaryDirectory() as folder:
        run = ("run", "puma560", "--set", "duration_s=4", "--out", folder)
        subprocess.run([VERGENCE, *run], check=True)
        screenshot(f"file://{folder}/report.html", (1100, 1330), "report.jpg")


def watch() -> None:
    """The page of `vergence watch`, some seconds after the start."""
    with tempfile.TemporaryDirectory() as folder:
        command = [VERGENCE, "watch", "panda", "--no-browser", "--port", "8246", "--out", folder]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as served:
            assert served.stdout
            served.stdout.readline()
            time.sleep(20.0)  # until it has loaded its kernels and moved a little
            try:
                screenshot("http://localhost:8246/", (1400, 900), "watch.jpg", wait_ms=12000)
            finally:
                served.send_signal(signal.SIGINT)


def screenshot(address: str, size: tuple[int, int], name: str, wait_ms: int = 0) -> None:
    """Write what a browser shows, in light and for a dark page, at three quarters of its size."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        raise SystemExit(f"{name} needs chromium on the path")
    for scheme, place in (("0", DOCS / "static" / "dark"), ("1", DOCS / "images")):
        with tempfile.TemporaryDirectory() as folder:
            shot = Path(folder, "shot.png")
            flags = ("--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader")
            flags += ("--enable-unsafe-swiftshader", "--hide-scrollbars")
            flags += (f"--user-data-dir={folder}/b", f"--window-size={size[0]},{size[1]}")
            flags += (f"--blink-settings=preferredColorScheme={scheme}", f"--screenshot={shot}")
            flags += (f"--virtual-time-budget={wait_ms}",) if wait_ms else ()
            subprocess.run([browser, *flags, address], check=True, stderr=subprocess.DEVNULL)
            small = cv2.resize(cv2.imread(str(shot)), None, fx=0.75, fy=0.75, interpolation=3)
        place.mkdir(exist_ok=True)
        cv2.imwrite(str(place / name), small, [cv2.IMWRITE_JPEG_QUALITY, 88])


if __name__ == "__main__":
    own_arm()
    own_object()
    two_blocks()
    imaging()
    report()
    watch()
    gallery()
