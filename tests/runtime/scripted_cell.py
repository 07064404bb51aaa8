"""A driver that needs no physics: joints go where they are told, images come as scripted."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.planning import FixedReference
from vergence.robot import Arm, Chain
from vergence.runtime import Loop
from vergence.signals import (
    Frame,
    ImagePoints,
    JointCommand,
    JointState,
    Observation,
    Reference,
    Sample,
    Setpoint,
)

DESIRED_PX = np.array([[320.0, 240.0], [300.0, 200.0]])


def flat_arm(n: int = 2, reach: float = 1.0) -> Arm:
    """Joints between ±reach, 2 rad/s and 8 rad/s² fast."""
    chain = Chain(
        np.tile(np.eye(3), (n + 1, 1, 1)), np.zeros((n + 1, 3)), np.zeros(n, dtype=np.bool_)
    )
    one = np.ones(n)
    names = tuple(f"joint{i + 1}" for i in range(n))
    return Arm(names, chain, -reach * one, reach * one, 2 * one, 8 * one)


@dataclass
class ScriptedDriver:
    """Its cameras expose at their rate; `lose` says which images never arrive."""

    inner_rate_hz: float = 500.0
    camera_rate_hz: float = 30.0
    latency_s: float = 0.0
    lose: Callable[[float], bool] = lambda exposed: False
    interrupt_at: int = -1
    arms: Mapping[str, Arm] = field(
        default_factory=lambda: {"left": flat_arm(), "right": flat_arm(3)}
    )
    cameras: Mapping[str, Camera] = field(
        default_factory=lambda: {"eye": Camera(64, 48, 60.0, 60.0, 31.5, 23.5)}
    )
    tick: int = 0
    setpoints: list[Mapping[str, Setpoint]] = field(default_factory=list)
    reads: list[int] = field(default_factory=list)
    delivered: int = 0

    def __post_init__(self) -> None:
        self.q = {name: np.zeros(arm.joint_count) for name, arm in self.arms.items()}

    @property
    def time(self) -> float:
        return self.tick / self.inner_rate_hz

    def read(self) -> Sample:
        self.reads.append(self.tick)
        frames = []
        while (exposed := self._exposure()) + self.latency_s <= self.time + 1e-9:
            self.delivered += 1
            if not self.lose(exposed):
                frames.append(Frame("eye", exposed, None, {}))
        still = {name: JointState(self.time, q.copy(), 0 * q) for name, q in self.q.items()}
        return Sample(self.time, still, tuple(frames))

    def _exposure(self) -> float:
        """When the next image is exposed: at an inner tick, as in simulation."""
        return int(self.delivered * self.inner_rate_hz / self.camera_rate_hz) / self.inner_rate_hz

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        if self.tick == self.interrupt_at:
            self.interrupt_at = -1
            raise KeyboardInterrupt
        self.tick += 1
        self.setpoints.append(setpoints)
        for name, setpoint in setpoints.items():
            self.q[name] = setpoint.position

    def close(self) -> None:
        pass

    def positions(self, arm: str = "left") -> FloatArray:
        return np.array([setpoints[arm].position for setpoints in self.setpoints])

    def velocities(self, arm: str = "left") -> FloatArray:
        return np.array([setpoints[arm].velocity for setpoints in self.setpoints])


@dataclass
class ScriptedEyes:
    """Finds every feature except as `hide` says: exposure time to a reason, or none."""

    hide: Callable[[float], str] = lambda exposed: ""
    hide_one: Callable[[float], str] = lambda exposed: ""

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        if not frames:
            return None
        exposed = frames[-1].time
        every = self.hide(exposed)
        reasons = (every or self.hide_one(exposed), every)
        view = ImagePoints(
            "eye",
            exposed,
            DESIRED_PX + 1.0,
            np.tile(np.eye(2), (2, 1, 1)),
            np.array([not reason for reason in reasons]),
            reasons,
        )
        return Observation(exposed, (view,))


@dataclass
class ScriptedLaw:
    """Asks for the same rates at every image; notes when, and what it saw."""

    rates: FloatArray
    fault: Callable[[int], object] = lambda count: None
    asked: list[Observation] = field(default_factory=list)

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        self.asked.append(observation)
        return JointCommand(self.rates, np.zeros(6), fault=self.fault(len(self.asked)))


@dataclass
class Notes:
    """A listener that keeps everything."""

    ticks: list = field(default_factory=list)
    events: list = field(default_factory=list)

    def begin(self, info) -> None: ...

    def tick(self, record) -> None:
        self.ticks.append(record)

    def event(self, time: float, name: str, text: str) -> None:
        self.events.append((time, name, text))

    def close(self, outcome, summary) -> None: ...


def looped(driver, eyes=None, law=None, rate_hz: float = 30.0, **options) -> Loop:
    return Loop(
        driver,
        "left",
        eyes or ScriptedEyes(),
        FixedReference(Reference(0.0, DESIRED_PX)),
        law or ScriptedLaw(np.array([0.3, -0.2])),
        outer_rate_hz=rate_hz,
        **options,
    )
