"""Images are drawn in a thread beside physics, and are those that a waiting loop would get."""

import gc
import threading

import numpy as np

from vergence.arrays import ImageArray
from vergence.camera import Camera
from vergence.cell import load_cell
from vergence.simulation import CameraRenderer, SimulatedDriver
from vergence.simulation.renderer import choose_renderer
from vergence.simulation.world import World

CELL = load_cell("puma560", {"cameras.wrist.noise_grey": "2.0"})
MOMENTS = (0.0, 0.3, -0.2, 0.1)  # by how far the first joint is turned, rad


def images(waiting: bool) -> list[ImageArray]:
    """Images of the arm at some moments, moved on as soon as each is begun, or taken."""
    choose_renderer()
    world = World(CELL)
    camera: Camera = world.cameras["wrist"]
    table = CELL.cameras["wrist"]
    renderer = CameraRenderer(world.model, "wrist", camera, table, np.random.default_rng(1))
    start = world.joint_position("puma")
    begun = []
    for turned in MOMENTS:
        world.place_arm("puma", start + [turned, 0, 0, 0, 0, 0])
        begun.append(renderer.begin(world.data, blind=turned < 0.0))
        if waiting:
            begun[-1].result()
    world.place_arm("puma", start)
    taken = [image.result() for image in begun]
    taken.append(renderer.take(world.data))
    renderer.close()
    return taken


def test_images_are_those_of_the_moment_at_which_they_are_begun() -> None:
    for beside, waited in zip(images(waiting=False), images(waiting=True), strict=True):
        np.testing.assert_array_equal(beside, waited)


def test_images_of_other_moments_differ() -> None:
    first, second, blind, _, last = images(waiting=False)
    assert np.mean(first != second) > 0.5
    assert blind.mean() < 3.0
    assert np.abs(first.astype(int) - last).mean() < 5.0  # the same place, with other noise


def test_a_driver_that_nobody_closes_frees_its_graphics_and_ends_its_threads() -> None:
    before = threading.active_count()
    for _ in range(2):
        driver = SimulatedDriver(CELL)
        assert threading.active_count() > before
        del driver
        gc.collect()  # pytest makes an error of what a finalizer raises
        for thread in threading.enumerate():
            if thread.name.startswith("renderer"):
                thread.join(10.0)
    assert threading.active_count() == before
