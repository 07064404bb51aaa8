"""The cameras of a simulated cell: when they expose, what arrives, and when."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vergence.arrays import ImageArray
from vergence.camera import image_tick
from vergence.cell.cell import Cell
from vergence.cell.schema import ImagingTable
from vergence.signals import Frame
from vergence.simulation.renderer import CameraRenderer
from vergence.simulation.row_weights import row_weights
from vergence.simulation.shutter import Shutter
from vergence.simulation.subject import Subject
from vergence.simulation.world import World


class _Arriving(NamedTuple):
    """An image that has not arrived yet."""

    arrival: int  # tick
    frame: Frame  # without its image while that is being rendered
    image: Future[ImageArray] | None = None

    def complete(self) -> Frame:
        """Return the frame with its image."""
        return self.frame if self.image is None else replace(self.frame, image=self.image.result())


class _Exposing(NamedTuple):
    """An image whose shutter is still open for some rows."""

    middle: int  # tick
    complete: int  # tick
    arrival: int  # tick, at the earliest
    frame: Frame  # without its image


class SimulatedCameras:
    """Exposes images at each camera's rate, and delivers them after its latency.

    The cameras have been running before the simulation begins: the first images are those exposed
    one latency earlier, at a negative time. Without images, frames carry only the ground truth.

    If a camera's `imaging` gives its shutter a duration, its time of exposure is the middle of that
    interval, and the image arrives no sooner than the shutter has closed.

    Args:
        cell: with the cameras.
        world: that they see.
        subject: provides the ground truth in frames.
        images: whether images are rendered.
    """

    def __init__(self, cell: Cell, world: World, subject: Subject, images: bool) -> None:
        self._cell, self._world, self._subject = cell, world, subject
        self._exposed = dict.fromkeys(cell.cameras, 0)
        self._queue: deque[_Arriving] = deque()
        self._before_motion: list[_Arriving] = []  # everything exposed before the start
        self._exposing: list[_Exposing] = []
        self._renderers = {
            name: CameraRenderer(
                world.model,
                name,
                world.cameras[name],
                table,
                np.random.default_rng([cell.seed, 2, number]),
            )
            for number, (name, table) in enumerate(cell.cameras.items())
            if images and name in cell.watched
        }
        self._imaging = {n: table.imaging or ImagingTable() for n, table in cell.cameras.items()}
        self._drops = {
            name: np.random.default_rng([cell.seed, 7, number])
            for number, name in enumerate(cell.cameras)
        }
        longest_s = max((self._imaging[name].open_s for name in self._renderers), default=0.0)
        self._shutter = Shutter(world, longest_s, cell.inner_rate_hz) if longest_s else None

    @property
    def render(self) -> bool:
        """Whether frames have images."""
        return bool(self._renderers)

    def restart(self) -> None:
        """Start again from the present view of the cameras, before the first tick."""
        self.clear()
        if self._shutter is not None:
            self._shutter.begin(0)
        self._exposed = dict.fromkeys(self._exposed, 0)
        for name, table in self._cell.cameras.items():
            if table.latency_frames:
                one, time = self._begin(name, 0, 0), -table.latency_frames / table.rate_hz
                self._queue.append(one._replace(frame=replace(one.frame, time=time)))
        self._expose(0, self._world.update)
        self._before_motion = list(self._queue)

    def clear(self) -> None:
        """Drop the images that have not arrived yet."""
        self._queue.clear()
        self._exposing.clear()

    def tell_again(self) -> None:
        """Deliver the images exposed before the start once more, with updated ground truth."""
        self._before_motion = [o._replace(frame=self._told(o.frame)) for o in self._before_motion]
        self._queue = deque(self._before_motion)

    def expose(self, tick: int, update: Callable[[], None]) -> None:
        """Take the images that are due at a tick, and complete those whose shutter has closed.

        Args:
            tick: now.
            update: updates everything that cameras see; called if an image is due.
        """
        if self._shutter is not None:
            update()
            self._shutter.remember(tick)
        self._expose(tick, update)
        for one in [one for one in self._exposing if one.complete <= tick]:
            self._exposing.remove(one)
            frame = replace(one.frame, image=self._moving_image(one))
            self._queue.append(_Arriving(max(one.arrival, tick), frame))

    def arrived(self, tick: int) -> tuple[Frame, ...]:
        """Return the frames that have arrived since the last call, the oldest first."""
        frames = [one.complete() for one in self._queue if one.arrival <= tick]
        self._queue = deque(one for one in self._queue if one.arrival > tick)
        return tuple(sorted(frames, key=lambda frame: frame.time))

    def frame(self, camera: str, tick: int) -> Frame:
        """Return the present view of a camera, its automatic exposure adapted to the scene."""
        return self._begin(camera, tick, tick).complete()

    def _begin(self, camera: str, tick: int, arrival: int, settled: bool = True) -> _Arriving:
        """Begin to take a camera's present view; see `Sensor.read`."""
        frame, renderer = self._without_image(camera, tick), self._renderers.get(camera)
        if renderer is None:
            return _Arriving(arrival, frame)
        image = renderer.begin(self._world.data, self._is_blind(camera, frame.time), settled)
        return _Arriving(arrival, self._with_depth(frame), image)

    def _without_image(self, camera: str, tick: int) -> Frame:
        joints = {name: self._world.joint_position(name) for name in self._world.arms}
        time = self._time(tick)
        truth = self._subject.truth(camera, self._is_blind(camera, time))
        return Frame(camera, time, None, joints, truth)

    def _with_depth(self, frame: Frame) -> Frame:
        sensor = self._cell.cameras[frame.camera].depth
        if sensor is None:
            return frame
        depth = self._renderers[frame.camera].depth(self._world.data, sensor)
        return replace(frame, depth_m=depth)

    def close(self) -> None:
        """Free the graphics contexts."""
        for renderer in self._renderers.values():
            renderer.close()

    def _told(self, frame: Frame) -> Frame:
        blind = self._is_blind(frame.camera, self._time(0))
        return replace(frame, truth=self._subject.truth(frame.camera, blind))

    def _time(self, tick: int) -> float:
        return tick / self._cell.inner_rate_hz

    def _expose(self, tick: int, update: Callable[[], None]) -> None:
        due = [name for name in self._cell.cameras if tick >= self._tick_of(name, 0)]
        if due:
            update()
        for name in due:
            arrival = self._tick_of(name, self._cell.cameras[name].latency_frames)
            first = not self._exposed[name]
            self._exposed[name] += 1
            if first:  # nothing has moved yet
                self._queue.append(self._begin(name, tick, arrival))
            elif not self._drops[name].random() < self._imaging[name].dropped:
                self._take(name, tick, arrival)

    def _tick_of(self, camera: str, later: int) -> int:
        """Return the tick of a camera's next image, or of a later one by its number."""
        number, rate_hz = self._exposed[camera] + later, self._cell.cameras[camera].rate_hz
        return image_tick(number, self._cell.inner_rate_hz, rate_hz)

    def _take(self, name: str, tick: int, arrival: int) -> None:
        """Take an image now, or begin to."""
        if self._shutter is None or name not in self._renderers or not self._imaging[name].open_s:
            self._queue.append(self._begin(name, tick, arrival, settled=False))
            return
        complete = tick + self._shutter.ticks_after(self._imaging[name])
        frame = self._with_depth(self._without_image(name, tick))
        self._exposing.append(_Exposing(tick, complete, arrival, frame))

    def _moving_image(self, one: _Exposing) -> ImageArray:
        name = one.frame.camera
        renderer, imaging, shutter = self._renderers[name], self._imaging[name], self._shutter
        assert shutter is not None
        if self._is_blind(name, one.frame.time):
            return renderer.take(self._world.data, blind=True, settled=False)
        moments = shutter.moments(name, one.middle, imaging)
        seconds = (moments - one.middle) / self._cell.inner_rate_hz
        weights = row_weights(seconds, self._world.cameras[name].height, imaging)
        return renderer.take_moving(shutter.at, moments, weights)

    def _is_blind(self, camera: str, time: float) -> bool:
        return any(a <= time < b for a, b in self._cell.cameras[camera].blind_s)
