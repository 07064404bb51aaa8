"""A running cell that can be watched, paused and changed, and whose target can be moved."""

import contextlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from vergence.app.warnings_once import tracebacks_in
from vergence.app.watch.commands import (
    ChooseLaw,
    Command,
    Grab,
    LetGo,
    Look,
    Move,
    Pause,
    Release,
    Reset,
    ResetLaw,
    Resume,
    SetSpeed,
    Step,
    Stop,
    TakeGoal,
    TrackPoints,
    TurnKnob,
)
from vergence.app.watch.drag import TargetDrag
from vergence.app.watch.inbox import Inbox
from vergence.app.watch.law_editor import LawEditor
from vergence.app.watch.newest_frames import NewestFrames
from vergence.app.watch.outline import outline_from, target_corners
from vergence.app.watch.pace import Pace
from vergence.app.watch.protocol import Request
from vergence.app.watch.publisher import Publisher
from vergence.app.watch.scene import Scene
from vergence.app.watch.view_state import ViewState
from vergence.app.watch.watched_driver import WatchedDriver
from vergence.assembly import LawContext, Parts, run_driver
from vergence.assembly.started_driver import StartedDriver
from vergence.control import Law
from vergence.errors import Absent, InputError, VergenceError
from vergence.runtime import Loop, Recorder, Run
from vergence.signals import Frame, Outcome, OutcomeKind

_KEPT_TICKS = 20_000  # in memory, some ten minutes; the recording has them all
_LOOK_UP_S = 0.1  # the longest wait without a look at whether Ctrl-C was pressed


class Live:
    """Runs a cell in step with the wall clock, repeatedly, and executes the requests of pages.

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
        self._context: LawContext | None = None  # of the task that runs, or ran last
        self._begun_with = editor.cell  # what the run was begun with
        self._task = 0  # its number
        self._law: Law | None = None  # what it goes by
        self._is_new = False  # whether the task has just begun
        self._recorder = Recorder(out, image_every)
        self._runs, self._again = 0, True
        self._newest = NewestFrames()
        self._picked_in: dict[str, Frame] = {}  # images to begin the next run with
        self._begun = 0.0  # s, the driver's time at which the run began
        self._goals = 0  # photographs taken
        self.view_state = ViewState()
        self._drag = TargetDrag(self._driver, self.view_state)
        self.scene = Scene(self._driver.world, self.view_state)

    @property
    def folder(self) -> Path:
        """Where the newest run is recorded."""
        return self._recorder.folder

    def ask(self, request: Request) -> None:
        """Add a request; it is executed between two turns of the loop."""
        self._inbox.ask(request)

    def run(self) -> Run:
        """Run the cell until Ctrl-C; return what came of the last run."""
        while self._again:
            self._again = False
            try:
                result = self._run_once()
            except InputError as error:  # what a page asks for must not end the command
                if not self._picked_in:
                    raise
                self._refuse_points(error)
            else:
                if not self._again and result.outcome.kind is not OutcomeKind.STOPPED:
                    self._rest()
            if self._again:
                self._begin_again()
        return result

    def close(self) -> None:
        """Release everything; a recording that is not finished is closed as it is."""
        reason = "the run ended unexpectedly, without a reason"
        self._recorder.close(Outcome(OutcomeKind.STOPPED, reason, self._recorder.now), {})
        self.scene.close()
        self._driver.close()

    def _run_once(self) -> Run:
        cell = self._begun_with = self._editor.cell
        self._task = 0
        self._editor.begin_task(0)
        about = {
            "mode": "live",
            "scene": True,
            "draggable": self._driver.world.target_is_free(),
            "carried_by": cell.target.carried_by,
            "images": self._images,
            "truth": True,
        }
        publisher = Publisher(self.view_state, cell, self._driver, about)
        self.view_state.status(preparing=True)  # until kernels are loaded and the loop begins
        self._tell()
        try:
            with tracebacks_in(self.folder):
                return run_driver(
                    cell,
                    self._driver,
                    (self._recorder, publisher, self._newest),
                    self._images,
                    duration_s=float("inf"),
                    attend=self._attend,
                    most_ticks=_KEPT_TICKS,
                    frames=self._picked_in,
                )
        finally:
            self.view_state.status(preparing=False)
            self._loop = None
            self._driver.between = None

    def _attend(self, loop: Loop, parts: Parts) -> None:
        self._context, self._law = parts.context, parts.law
        if self._loop is loop:  # another task of the same run
            self._task += 1
            self._editor.begin_task(self._task)
            self._editor.offer(parts.context)
            self._is_new = True
            return
        self._loop = loop
        self._editor.offer(parts.context)
        self.view_state.status(preparing=False)
        self._driver.between = self._between
        self._begun = self._driver.time
        if self._picked_in:
            self._say("points picked", "the arm keeps them where they are in the image")

    def _begin_again(self) -> None:
        """Begin again in a new folder: from the start, or where the arm is with picked points."""
        self._runs += 1
        folder = self._out.with_name(f"{self._out.name}-{self._runs + 1}")
        self._recorder = Recorder(folder, self._image_every)
        if self._picked_in:
            return
        self._driver.close()
        self._driver = WatchedDriver(self._editor.cell, self._images)
        self._drag = TargetDrag(self._driver, self.view_state)

    def _rest(self) -> None:
        """Do what is asked after a run has ended, until it shall begin again, or Ctrl-C."""
        with contextlib.suppress(KeyboardInterrupt):
            while not self._again:
                self._inbox.obey(self._do, timeout_s=_LOOK_UP_S)
                self._tell()

    def _between(self, time: float) -> None:
        """Show the world; wait for the clock; do what was asked."""
        self._show()
        if self._is_new:
            self._is_new = False
            self._take_changes()
        while not self._stopping and (delay := self._pace.delay(time)) != 0.0:
            self._tell()
            self._inbox.obey(self._do, timeout_s=min(delay or _LOOK_UP_S, _LOOK_UP_S))
        while not self._inbox.empty:
            self._inbox.obey(self._do, timeout_s=0.0)
        self._tell()

    @property
    def _stopping(self) -> bool:
        return self._loop is not None and self._loop.stopping

    @property
    def _time(self) -> float:
        """Since the run began, s."""
        return self._driver.time - self._begun

    def _show(self) -> None:
        world = self._driver.world
        self.view_state.state = world.state()
        around = outline_from(self.scene.viewer_camera, self._corners, world.target_pose())
        self.view_state.status(
            time=self._time, outline=around, fovy=self.scene.viewer_camera.fovy_deg
        )

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
                self._forget_points()
                self._stop()
            case Stop():
                raise InputError(
                    "message", "do", command.do, "only together with --driver; pause instead"
                )
            case TrackPoints():
                self._track(command)
            case TakeGoal():
                self._take_goal()
            case Look():
                self.scene.look(command)
            case ChooseLaw(name=name):
                self._change_law(lambda context: self._editor.choose(name, context))
            case ResetLaw():
                self._change_law(self._editor.reset)
            case TurnKnob(key=key, value=value):
                self._change_law(lambda context: self._editor.turn(key, value, context))
            case Move() | Release() if self._loop is None:
                pass  # of a drag that was refused, or that the end of the run interrupted
            case Grab() | LetGo() if self._loop is None:
                raise VergenceError("The run has ended; Restart begins another.")
            case _ if self._driver.world.target_is_free():
                self._move_target(command)

    def _stop(self) -> None:
        """End this run, so that another begins."""
        self._again = True
        if self._loop is not None:
            self._loop.stop()

    def _track(self, command: TrackPoints) -> None:
        """Keep points where they are in the newest image, from where the arm is."""
        frame = self._newest_frame()
        if frame.time != command.time:
            given = f"{command.time:g} s, which is not the newest image"
            raise InputError("message", "time", given, "points picked while the run is paused")
        self._editor.track(command.points)
        self._picked_in = {frame.camera: replace(frame, time=frame.time + self._begun)}
        self._pace.resume()
        self._stop()

    def _forget_points(self) -> None:
        self._picked_in = {}
        self._editor.forget_points()

    def _refuse_points(self, error: InputError) -> None:
        """Return why points cannot be tracked; the arm rests until another request."""
        self._forget_points()
        self._say("points refused", str(error))
        self.view_state.status(
            outcome={
                "kind": "points refused",
                "reason": str(error),
                "time": self._time,
                "succeeded": False,
            }
        )
        self._rest()

    def _take_goal(self) -> None:
        """Keep the newest image as a goal, in the folder of the run."""
        from vergence.app.goal import keep_photograph

        self._goals += 1
        path = self.folder / f"goal-{self._goals}.png"
        keep_photograph(path, self._newest_frame(), self._driver)
        self._say("goal taken", f"saved as {path}; to go there, run with --goal {path}")

    def _newest_frame(self) -> Frame:
        frame = self._newest.frames.get(self._editor.cell.task.camera)
        if frame is None or frame.image is None:
            raise InputError("message", "", Absent("no image yet"), "a run with images")
        return frame

    @property
    def _law_context(self) -> LawContext:
        stage = self._editor.stage
        return self._context or LawContext.of(stage, StartedDriver(self._driver, stage.watched))

    def _change_law(self, change: Callable[[LawContext], Law]) -> None:
        """Go by another law from now on, if it is another one."""
        before, context = self._editor.settings, self._law_context
        law = change(context)
        if self._editor.settings != before:
            self._editor.offer(context)
            self._replace_law(law)

    def _replace_law(self, law: Law) -> None:
        # Between two tasks the arm comes to rest by a law of its own.
        if self._loop is not None and self._loop.law is self._law:
            self._loop.replace_law(law)
            self._law = law
        self._say("law changed", ", ".join(self._editor.settings) or "reset to the cell's settings")

    def _take_changes(self) -> None:
        """Apply changes of a law since the start of the run to a task that has just begun."""
        assert self._context is not None
        try:
            law = self._editor.law_after(self._begun_with, self._context)
        except InputError as error:
            self._say("law not changed", str(error))
            return
        if law is not None:
            self._replace_law(law)

    def _move_target(self, command: Command) -> None:
        match command:
            case Grab(view=view, u=u, v=v):
                self._drag.grab(view, u, v, self.scene.viewer_camera)
            case Move(view=view, u=u, v=v, along=along, turn=turn):
                self._drag.move(view, u, v, along, turn)
            case Release():
                if done := self._drag.release():
                    self._say("target moved", done)
            case LetGo():
                self._driver.target.held = False
                self._say("target let go", "it moves by itself again")

    def _say(self, name: str, text: str) -> None:
        time = self._time
        self.view_state.event(time, name, text)
        if self._recorder.running:
            self._recorder.event(time, name, text)
