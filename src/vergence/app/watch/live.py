"""A cell that runs while somebody watches, pauses it, turns its knobs and moves its target."""

import contextlib
from pathlib import Path

from vergence.app.watch.commands import (
    ChooseLaw,
    Command,
    Grab,
    LetGo,
    Move,
    Pause,
    Release,
    Reset,
    Resume,
    SetSpeed,
    Step,
    TurnKnob,
)
from vergence.app.watch.drag import TargetDrag
from vergence.app.watch.inbox import Inbox
from vergence.app.watch.law_editor import LawEditor
from vergence.app.watch.outline import outline_from, target_corners
from vergence.app.watch.pace import Pace
from vergence.app.watch.protocol import Request
from vergence.app.watch.publisher import Publisher
from vergence.app.watch.scene import Scene, world_state
from vergence.app.watch.view_state import ViewState
from vergence.app.watch.watched_driver import WatchedDriver
from vergence.assembly import LawContext, Parts, run_driver
from vergence.assembly.started_driver import StartedDriver
from vergence.control import Law
from vergence.runtime import Loop, Recorder, Run
from vergence.signals import Outcome, OutcomeKind

_KEPT_TICKS = 20_000  # in memory, some ten minutes; the recording has them all
_LOOK_UP_S = 0.1  # the longest wait without a look at whether Ctrl-C was pressed


class Live:
    """Runs a cell beside the wall clock, again and again, and does what pages ask for.

    It runs in the thread that calls `run`; `ask` may be called from any.

    Args:
        editor: has the cell.
        images: look through rendered images; if not, at exact projections.
        out: folder of the recording; runs after a reset get a number behind it.
        image_every: record every n-th image.

    Attributes:
        view_state: what there is to show.
        scene: the view in three dimensions.
        folder: of the newest recording.
    """

    def __init__(self, editor: LawEditor, images: bool, out: Path, image_every: int) -> None:
        self._editor, self._images = editor, images
        self._out, self._image_every = out, image_every
        self._inbox = Inbox()
        self._pace = Pace()
        self._driver = WatchedDriver(editor.cell, images)
        self._corners = target_corners(self._driver.world)
        self._loop: Loop | None = None
        self._context: LawContext | None = None  # of the last run
        self._recorder = Recorder(out, image_every)
        self._runs, self._again = 0, True
        self.view_state = ViewState()
        self._drag = TargetDrag(self._driver, self.view_state)
        self.scene = Scene(self._driver.world, self.view_state)

    @property
    def folder(self) -> Path:
        """Where the newest run is recorded."""
        return self._recorder.folder

    def ask(self, request: Request) -> None:
        """Ask for something; it is done between two turns of the loop."""
        self._inbox.ask(request)

    def run(self) -> Run:
        """Run the cell until Ctrl-C; return what came of the last run."""
        while self._again:
            self._again = False
            result = self._run_once()
            if not self._again and result.outcome.kind is not OutcomeKind.STOPPED:
                self._rest()
            if self._again:
                self._stand_up()
        return result

    def close(self) -> None:
        """Let go of everything; a recording that is not finished is closed as it is."""
        reason = "the run broke off before it could say why"
        self._recorder.close(Outcome(OutcomeKind.STOPPED, reason, self._recorder.now), {})
        self.scene.close()
        self._driver.close()

    def _run_once(self) -> Run:
        cell = self._editor.cell
        about = {
            "mode": "live",
            "scene": True,
            "draggable": self._driver.world.target_is_free,
            "carried_by": cell.target.carried_by,
        }
        publisher = Publisher(self.view_state, cell, self._driver, about)
        self._tell()
        try:
            return run_driver(
                cell,
                self._driver,
                (self._recorder, publisher),
                self._images,
                duration_s=float("inf"),
                attend=self._attend,
                most_ticks=_KEPT_TICKS,
            )
        finally:
            self._loop = None
            self._driver.between = None

    def _attend(self, loop: Loop, parts: Parts) -> None:
        self._loop, self._context = loop, parts.context
        self._driver.between = self._between

    def _stand_up(self) -> None:
        """Begin again from the start, in a new folder."""
        self._driver.close()
        self._runs += 1
        folder = self._out.with_name(f"{self._out.name}-{self._runs + 1}")
        self._recorder = Recorder(folder, self._image_every)
        self._driver = WatchedDriver(self._editor.cell, self._images)
        self._drag = TargetDrag(self._driver, self.view_state)

    def _rest(self) -> None:
        """Do what is asked after a run has ended, until it shall begin again, or Ctrl-C."""
        with contextlib.suppress(KeyboardInterrupt):
            while not self._again:
                self._inbox.obey(self._do, timeout_s=None)
                self._tell()

    def _between(self, time: float) -> None:
        """Show the world; wait for the clock; do what was asked."""
        self._show(time)
        while not self._stopping and (delay := self._pace.delay(time)) != 0.0:
            self._tell()
            self._inbox.obey(self._do, timeout_s=min(delay or _LOOK_UP_S, _LOOK_UP_S))
        while not self._inbox.empty:
            self._inbox.obey(self._do, timeout_s=0.0)
        self._tell()

    @property
    def _stopping(self) -> bool:
        return self._loop is not None and self._loop.stopping

    def _show(self, time: float) -> None:
        world = self._driver.world
        self.view_state.state = world_state(world.model, world.data)
        around = outline_from(self.scene.viewer_camera, self._corners, world.target_pose())
        self.view_state.status(time=time, outline=around, fovy=self.scene.viewer_camera.fovy_deg)

    def _tell(self) -> None:
        pace = self._pace
        self.view_state.status(
            paused=pace.paused,
            speed=pace.speed,
            measured=round(pace.measured, 2),
            held=self._driver.target.held,
            law=self._editor.as_json(),
            folder=str(self.folder),
        )

    def _do(self, command: Command) -> None:
        match command:
            case Pause():
                self._pace.pause()
            case Resume():
                self._pace.resume()
            case Step():
                self._pace.step()
            case SetSpeed(value=speed):
                self._pace.set_speed(speed)
            case Reset():
                self._again = True
                if self._loop is not None:
                    self._loop.stop()
            case ChooseLaw(name=name):
                self._replace_law(self._editor.choose(name, self._law_context))
            case TurnKnob(key=key, value=value):
                self._replace_law(self._editor.turn(key, value, self._law_context))
            case _ if self._driver.world.target_is_free:
                self._move_target(command)

    @property
    def _law_context(self) -> LawContext:
        cell = self._editor.cell
        return self._context or LawContext.of(cell, StartedDriver(self._driver, cell.watched))

    def _replace_law(self, law: Law) -> None:
        if self._loop is not None:
            self._loop.replace_law(law)
        changes = self._editor.as_json()["settings"]
        self._say("law changed", ", ".join(changes) or "back to the cell's own")

    def _move_target(self, command: Command) -> None:
        match command:
            case Grab(view=view, u=u, v=v):
                self._drag.grab(view, u, v, self.scene.viewer_camera)
            case Move(view=view, u=u, v=v, along=along):
                self._drag.move(view, u, v, along)
            case Release():
                self._drag.release()
            case LetGo():
                self._driver.target.held = False

    def _say(self, name: str, text: str) -> None:
        time = self._driver.time
        self.view_state.event(time, name, text)
        if self._recorder.running:
            self._recorder.event(time, name, text)
