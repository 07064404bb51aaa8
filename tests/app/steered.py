"""A page that steers a running cell, without a browser."""

import threading
import time
from collections.abc import Callable

import numpy as np

from vergence.app.watch.commands import Command
from vergence.app.watch.live import Live
from vergence.app.watch.live_robot import LiveRobot
from vergence.app.watch.protocol import Request
from vergence.app.watch.view_state import Reader
from vergence.app.watch.viewer_camera import ViewerCamera
from vergence.runtime import Run

PATIENCE_S = 120.0


def wait(until: Callable[[], object]) -> None:
    end = time.monotonic() + PATIENCE_S
    while not until():
        assert time.monotonic() < end
        time.sleep(0.02)


class NoScene:
    """In place of the view in three dimensions, which listens in threads of its own."""

    viewer_camera = ViewerCamera.around(np.zeros(3), 2.0, 90.0, -20.0, 45.0)

    def __init__(self, world: object, view_state: object) -> None:
        pass

    def close(self) -> None:
        pass


class Steered:
    """A running cell that is asked for things, as by a page.

    Attributes:
        refused: why, of each command that was.
    """

    def __init__(self, live: Live | LiveRobot) -> None:
        self._live, self.refused = live, list[str]()

    def ask(self, command: Command) -> None:
        self._live.ask(Request(command, self.refused.append))

    def status(self) -> dict[str, object]:
        """What the page is told of the run."""
        news = self._live.view_state.news(Reader())
        return {} if news is None else dict(news.status)

    def run(self, steps: Callable[[], None], end: Callable[[], None]) -> Run:
        """Run the cell while steps are done in another thread, whose end ends the run."""

        def steer() -> None:
            try:
                steps()
            finally:
                end()

        steering = threading.Thread(target=steer)
        steering.start()
        try:
            return self._live.run()
        finally:
            steering.join()
            self._live.close()
