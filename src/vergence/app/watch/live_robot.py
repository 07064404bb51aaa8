"""A real cell that can be watched, and stopped, in the browser."""

import contextlib
from pathlib import Path

from vergence.app.watch.commands import Command, Stop
from vergence.app.watch.inbox import Inbox
from vergence.app.watch.protocol import Request
from vergence.app.watch.publisher import Publisher
from vergence.app.watch.scene import Scene
from vergence.app.watch.view_state import ViewState
from vergence.app.watch.watched_robot import WatchedRobot
from vergence.assembly import Parts, run_driver
from vergence.cell import Cell
from vergence.errors import InputError
from vergence.runtime import Driver, Loop, Recorder, Run
from vergence.signals import Outcome, OutcomeKind, Sample
from vergence.simulation import SimulatedDriver

_LOOK_UP_S = 0.1  # the longest wait without a look at whether this is to end
_KEPT_TICKS = 20_000  # in memory; the recording has them all


class LiveRobot:
    """Runs a cell on a robot once, shows it, and brakes the arm when a page asks for it.

    The view in three dimensions shows the arm where its joints are, and everything else where the
    cell file has it. Nothing else can be asked for: the law stays as it is, since another one might
    have to be compiled while the arm moves.

    Args:
        cell: that is run.
        driver: of the robot.
        servo_lag_s: by which it follows late, s.
        out: folder of the recording.
        image_every: record every n-th image.

    Attributes:
        view_state: what there is to show.
        scene: the view in three dimensions.
        folder: of the recording.
    """

    def __init__(
        self, cell: Cell, driver: Driver, servo_lag_s: float, out: Path, image_every: int
    ) -> None:
        self._cell, self._servo_lag_s = cell, servo_lag_s
        self._driver = WatchedRobot(driver, cell.outer_rate_hz)
        self._mirror = SimulatedDriver(cell, images=False)
        self._recorder = Recorder(out, image_every)
        self._inbox = Inbox()
        self._loop: Loop | None = None
        self._asked_to_stop, self._stays = False, True
        self._begun = 0.0  # s, the driver's time at which the run began
        self.folder = out
        self.view_state = ViewState()
        self.scene = Scene(self._mirror.world, self.view_state)

    def ask(self, request: Request) -> None:
        """Add a request; it is executed between two turns of the loop."""
        self._inbox.ask(request)

    def run(self) -> Run:
        """Run the cell to its end, or until a page or Ctrl-C stops it; show that until Ctrl-C."""
        about = {
            "mode": "robot",
            "scene": True,
            "draggable": False,
            "carried_by": self._cell.target.carried_by,
            "images": True,
            "truth": False,
        }
        publisher = Publisher(self.view_state, self._cell, self._mirror, about)
        self.view_state.status(preparing=True, folder=str(self.folder))
        result = run_driver(
            self._cell,
            self._driver,
            (self._recorder, publisher),
            True,
            duration_s=float("inf"),
            attend=self._attend,
            most_ticks=_KEPT_TICKS,
            servo_lag_s=self._servo_lag_s,
            self_calibration=True,
        )
        self._loop = self._driver.between = None
        self.view_state.status(preparing=False)
        if self._asked_to_stop or result.outcome.kind is not OutcomeKind.STOPPED:
            with contextlib.suppress(KeyboardInterrupt):
                while self._stays:
                    self._inbox.obey(self._do, timeout_s=_LOOK_UP_S)
        return result

    def close(self) -> None:
        """Release everything; a recording that is not finished is closed as it is."""
        reason = "the run ended unexpectedly, without a reason"
        self._recorder.close(Outcome(OutcomeKind.STOPPED, reason, self._recorder.now), {})
        self.scene.close()
        self._mirror.close()
        self._driver.close()

    def _attend(self, loop: Loop, parts: Parts) -> None:
        if self._loop is loop:  # another task of the same run
            return
        self._loop, self._begun = loop, self._driver.time
        self.view_state.status(preparing=False)
        self._driver.between = self._between

    def _between(self, sample: Sample) -> None:
        """Show where the arms are; do what was asked."""
        world = self._mirror.world
        world.place({name: state.position for name, state in sample.joints.items()})
        self.view_state.state = world.state()
        self.view_state.status(
            time=sample.time - self._begun, fovy=self.scene.viewer_camera.fovy_deg
        )
        while not self._inbox.empty:
            self._inbox.obey(self._do, timeout_s=0.0)

    def _do(self, command: Command) -> None:
        if not isinstance(command, Stop):
            raise InputError("message", "do", command.do, "stop; a real arm takes no other command")
        self._asked_to_stop = True
        if self._loop is not None:
            self._loop.stop()
