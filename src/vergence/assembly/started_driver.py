"""A driver whose cameras have delivered their first images, with the clock of the run."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from time import monotonic

from vergence.arrays import FloatArray
from vergence.planning.approach import InlineWorker, ThreadWorker, Worker
from vergence.runtime import Driver, DriverWrapper
from vergence.signals import Frame, JointState, Sample

_TIMEOUT_S = 5.0  # for a first image
_BEHIND_S = 10.0  # by which a driver may be behind, at most
_LEVEL_STEPS = 3  # in a row that gain no time, after which it is not


class StartedDriver(DriverWrapper):
    """Passes on to a driver, after it has waited for an image of each camera without a set-point.

    What a task begins with is read off these images. The run begins with the first `read` after
    that, however long it took to assemble the loop; only what is exposed from then on is delivered.
    Samples keep the driver's time: the loop counts from its first one.

    Args:
        driver: of arms and cameras.
        cameras: names of those that are needed.
        frames: images to begin with, by camera, at times of the driver; nobody waits for those.

    Attributes:
        driver: the same.
        frames: what a task begins with: an image of each camera that delivered one, by name; of
            the first task at times up to 0, of another when the arm had come to rest before it.
        missing: names of cameras that delivered none in time.
        start: positions when they had, by arm name, (n,), rad or m.

    Raises:
        DriverSilent: if the driver does not answer.
    """

    def __init__(
        self,
        driver: Driver,
        cameras: Sequence[str],
        frames: Mapping[str, Frame] | None = None,
    ) -> None:
        super().__init__(driver)
        given = frames or {}
        first: dict[str, Frame] = dict(given)
        sample = self._now(driver.read())
        for _ in range(int(_TIMEOUT_S * driver.inner_rate_hz)):
            first |= {f.camera: f for f in sample.frames if f.camera not in given}
            if all(name in first for name in cameras):
                break
            driver.step({})  # a watchdog that has heard a set-point would not wait for the rest
            sample = driver.read()
        self.missing = tuple(name for name in cameras if name not in first)
        self._sample = sample  # the newest
        self.start = self.joints
        self.frames = {name: _since(sample.time, frame) for name, frame in first.items()}
        self._waited_until = sample.time
        self._begin: float | None = None

    def worker(self) -> Worker:
        """Return who does what takes longer than an image, without delaying the loop."""
        return InlineWorker() if self.sim_time else ThreadWorker()

    @property
    def joints(self) -> dict[str, FloatArray]:
        """Newest positions by arm name, (n,), rad or m."""
        return {name: state.position for name, state in self._sample.joints.items()}

    @property
    def states(self) -> Mapping[str, JointState]:
        """Newest joint states by arm name."""
        return self._sample.joints

    def time_left(self, duration_s: float) -> float:
        """Return how much of the time of a run is left to a task that begins with the images, s."""
        return duration_s - max([0.0, *(frame.time for frame in self.frames.values())])

    def read(self) -> Sample:
        """Return joints now and the images that arrived since the last call."""
        sample = self.driver.read()
        if self._begin is None:
            sample = self._now(sample)
        self._sample = sample
        if self._begin is None:
            self._begin = sample.time
            if sample.time == self._waited_until:  # nothing moved: what was seen is of the run
                known = {(frame.camera, frame.time) for frame in sample.frames}
                unread = (_since(-sample.time, frame) for frame in self.frames.values())
                more = (f for f in unread if (f.camera, f.time) not in known)
                sample = replace(sample, frames=(*sample.frames, *more))
        if not sample.frames:
            return sample
        of_run = (frame for frame in sample.frames if not frame.time < self._begin)
        return replace(sample, frames=tuple(sorted(of_run, key=lambda frame: frame.time)))

    def _now(self, sample: Sample) -> Sample:
        """Return a sample of now, with all images since a given one.

        Joints are those of the last step, which is as old as it took to open cameras or to assemble
        the loop. A run that began with them would miss that time, and its images, in its second
        tick. While steps catch up, the driver's time runs faster than this computer's.
        """
        if self.sim_time:
            return sample
        rate_hz, frames, level = self.driver.inner_rate_hz, sample.frames, 0
        for _ in range(int(_BEHIND_S * rate_hz)):
            begun, before = monotonic(), sample.time
            self.driver.step({})
            sample = self.driver.read()
            frames += sample.frames
            gained_s = sample.time - before - (monotonic() - begun)
            level = level + 1 if gained_s < 0.5 / rate_hz else 0
            if level == _LEVEL_STEPS:
                break
        return replace(sample, frames=frames)


def _since(begin: float, frame: Frame) -> Frame:
    return replace(frame, time=frame.time - begin) if begin else frame
