"""A recording on the live page: it plays, pauses and follows the slider."""

import contextlib
from time import perf_counter

import numpy as np

from vergence.app.recorded_world import RecordedWorld
from vergence.app.watch.commands import Command, Look, Pause, Reset, Resume, Seek, SetSpeed, Step
from vergence.app.watch.inbox import Inbox
from vergence.app.watch.playback import Playback
from vergence.app.watch.protocol import Request
from vergence.app.watch.scene import Scene
from vergence.app.watch.view_state import ViewState
from vergence.runtime.recording import Recording

_PERIOD_S = 1 / 30


class Replay:
    """Shows a recording; runs in the thread that calls `run`, `ask` may be called from any.

    Args:
        recording: of the run.

    Attributes:
        view_state: what there is to show.
        scene: the view in three dimensions, where the cell is known.
    """

    def __init__(self, recording: Recording) -> None:
        world = RecordedWorld.of(recording.info)
        known = world if isinstance(world, RecordedWorld) else None
        self._recording = recording
        self._playback = Playback(recording, known)
        self._inbox = Inbox()
        self._time, self._speed, self._paused = 0.0, 1.0, True
        self.view_state = ViewState()
        self.scene: Scene | None = None
        if known is not None:
            self.scene = Scene(known.world, self.view_state)
        self._begin("" if known is not None else str(world))

    def ask(self, request: Request) -> None:
        """Add a request; it is executed before the next instant is shown."""
        self._inbox.ask(request)

    def run(self) -> None:
        """Play until Ctrl-C."""
        with contextlib.suppress(KeyboardInterrupt):
            self._play()

    def close(self) -> None:
        """Release everything."""
        if self.scene is not None:
            self.scene.close()

    def _play(self) -> None:
        before = perf_counter()
        while True:
            self._inbox.obey(self._do, timeout_s=_PERIOD_S)
            now = perf_counter()
            if not self._paused:
                self._go_to(self._time + self._speed * (now - before))
            before = now
            self._show()

    def _begin(self, why_no_scene: str) -> None:
        info, outcome = self._recording.info, self._recording.outcome
        about = {
            "mode": "recording",
            "cell": info.cell,
            "duration": self._recording.duration,
            "cameras": [
                {"name": n, "width": info.cameras[n].width, "height": info.cameras[n].height}
                for n in self._playback.cameras
            ],
            "plots": [plot.as_json() for plot in self._playback.plots],
            "scene": self.scene is not None,
            "no_scene": f"No 3D view: {why_no_scene}",
            "draggable": False,
            "truth": self._playback.knows_truth,
        }
        self.view_state.begin(about, self._playback.rows())
        for event in self._recording.events:
            self.view_state.event(event.time, event.name, event.text)
        end = {"kind": outcome.kind.value, "reason": outcome.reason, "time": outcome.time}
        self.view_state.status(outcome={**end, "succeeded": outcome.succeeded})
        self._show()

    def _show(self) -> None:
        state = self._playback.state(self._time)
        if state is not None:
            self.view_state.state = state
        self.view_state.show(self._playback.views(self._time))
        self.view_state.status(
            time=self._time,
            paused=self._paused,
            speed=self._speed,
            limits=self._playback.limits(self._time),
        )

    def _go_to(self, time: float) -> None:
        self._time = min(max(time, 0.0), self._recording.duration)
        if self._time == self._recording.duration:
            self._paused = True

    def _do(self, command: Command) -> None:
        match command:
            case Pause():
                self._paused = True
            case Resume():
                self._paused = False
                if self._time == self._recording.duration:
                    self._time = 0.0
            case Step():
                self._paused = True
                times = self._playback.times()
                later = times[times > self._time + 1e-9]
                self._go_to(float(later[0]) if len(later) else np.inf)
            case SetSpeed(value=speed):
                self._speed = speed
            case Seek(value=time):
                self._go_to(time)
            case Reset():
                self._go_to(0.0)
            case Look() if self.scene is not None:
                self.scene.look(command)
