"""A camera of this computer whose images are rendered from where a real driver's arm is."""

from collections import deque
from collections.abc import Callable, Mapping

from vergence.arrays import FloatArray
from vergence.cell import Cell
from vergence.signals import Frame
from vergence.simulation import SimulatedDriver
from vergence.simulation.motion import target_pose


class Rendered:
    """Exposes at the camera's rate by the driver's clock, and delivers its latency later."""

    def __init__(self, cell: Cell) -> None:
        self._cell, self._simulated = cell, SimulatedDriver(cell)
        self._pose = target_pose(cell.target, cell.target.motion, cell.seed)

    def open(self, name: str, clock: Callable[[], float]) -> "Rendered":
        table = self._cell.cameras[name]
        self._name, self._clock, self._period = name, clock, 1.0 / table.rate_hz
        self._late = table.latency_frames * self._period
        self._begin = self._due = clock()
        self._waiting: deque[Frame] = deque()
        return self

    def clocked_by(self, clock: Callable[[], float]) -> None:
        """Expose by another clock than that of this computer."""
        self._clock = clock

    def frames(self, joints_at: Callable[[float], Mapping[str, FloatArray]]) -> tuple[Frame, ...]:
        now = self._clock()
        if now >= self._due:  # an image that a busy computer missed is dropped, as by a camera
            self._due += self._period * ((now - self._due) // self._period)
            self._waiting.append(self._exposed(self._due, joints_at(self._due)))
            self._due += self._period
        arrived = []
        while self._waiting and self._waiting[0].time + self._late <= now:
            arrived.append(self._waiting.popleft())
        return tuple(arrived)

    def _exposed(self, time: float, joints: Mapping[str, FloatArray]) -> Frame:
        world = self._simulated.world
        for arm, position in joints.items():
            world.place_arm(arm, position)
        world.move_target(self._pose(time - self._begin))
        world.update()
        image = self._simulated.first_frame(self._name).image
        return Frame(self._name, time, image, joints)

    def close(self) -> None:
        self._simulated.close()
