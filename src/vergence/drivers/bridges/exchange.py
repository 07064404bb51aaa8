"""Periods that go to the driver, and their answers."""

from collections.abc import Iterable
from queue import SimpleQueue
from threading import Lock, Thread
from typing import Any

from .joints import Joints
from .wire import Wire


class Exchange:
    """Sends the newest joints, and images with them, as fast as the driver answers.

    Nothing piles up: while the driver owes an answer, it gets no more; then it gets the newest
    joints and the newest image of each camera.

    Args:
        wire: to the driver.
        arm: its name in the cell.
        outputs: names of those that the robot has.
    """

    def __init__(self, wire: Wire, arm: str, outputs: Iterable[str]) -> None:
        self._wire, self._arm = wire, arm
        self._outputs = list(outputs)
        self._lock = Lock()
        # The newest of each camera: time, encoding and bytes.
        self._images: dict[str, tuple[float, str, bytes]] = {}
        self._waiting: dict[str, Any] | None = None  # the newest joints, while none may be sent
        self._period = self._sent = self._answered = 0
        self._outbox: SimpleQueue[tuple[dict[str, Any], list[bytes]]] = SimpleQueue()
        Thread(target=self._send_all, daemon=True).start()

    def joints(self, joints: Joints, robot: list[Any] | None) -> None:
        """Take joints, and mode and speed scale of the robot if it tells."""
        with self._lock:
            self._period += 1
            robots = {} if robot is None else {self._arm: robot}
            told = {self._arm: [joints.position, joints.velocity]}
            words = {"period": self._period, "time": joints.time, "joints": told}
            self._waiting = words | {"robots": robots, "outputs": self._outputs}
            self._offer()

    def image(self, camera: str, time: float, encoding: str, block: bytes) -> None:
        """Take an image that was exposed at a time, s, of the joints' clock."""
        with self._lock:
            self._images[camera] = time, encoding, block

    def answered(self, period: int) -> None:
        """Note that the driver has answered a period."""
        with self._lock:
            self._answered = period
            self._offer()

    def _offer(self) -> None:
        if self._waiting is None or self._answered < self._sent:
            return
        about = [[camera, *image[:2]] for camera, image in self._images.items()]
        blocks = [block for _, _, block in self._images.values()]
        self._images.clear()
        self._sent = self._waiting["period"]
        self._outbox.put((self._waiting | {"images": about}, blocks))
        self._waiting = None

    def _send_all(self) -> None:
        """Send in a thread of its own: a driver that is busy must hold up nothing."""
        while True:
            self._wire.send(*self._outbox.get())
