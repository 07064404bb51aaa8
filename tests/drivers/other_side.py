"""What the tests of drivers share: the other side of a protocol, and a joint that is turned."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from vergence.control import Guard
from vergence.runtime import Driver
from vergence.signals import Sample

_CLIENT = """
import sys
sys.path.insert(0, sys.argv[1])
from other_side import Motion
{opening}
motion = Motion(driver)
motion.go(0.3, 1.0)
print("moving", flush=True)
motion.go(0.3, 60)
"""


@contextmanager
def client_to_be_killed(opening: str, *arguments: str) -> Iterator[None]:
    """Turn an arm's last joint at 0.3 rad/s from another process; kill that in the end.

    Args:
        opening: lines that make `driver`; arguments are from `sys.argv[2]` on.
        arguments: for them.
    """
    program = _CLIENT.format(opening=opening)
    words = [sys.executable, "-c", program, str(Path(__file__).parent), *arguments]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as client:
        try:
            assert client.stdout is not None
            assert client.stdout.readline() == "moving\n"
            yield
        finally:
            client.kill()


class OtherSide:
    """A robot in a process of its own; it answers a line of words with a line.

    Args:
        program: the name of a script in this folder.
        arguments: of the script.
        python: options of its Python; "-S" leaves out packages that it does not need.
    """

    def __init__(self, program: str, *arguments: str, python: tuple[str, ...] = ()) -> None:
        self.process = subprocess.Popen(
            [sys.executable, *python, str(Path(__file__).with_name(program)), *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def wait_until_ready(self) -> None:
        """Read what it says until it says that it is ready."""
        while (line := self.line()) != "ready":
            assert line, "the robot's process has ended"

    def set(self, words: str) -> None:
        """Change something of the robot."""
        assert self.ask(words) == "ok"

    def tell(self) -> dict[str, object]:
        """Return what the robot says of itself."""
        return json.loads(self.ask("tell"))

    def ask(self, words: str) -> str:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{words}\n")
        self.process.stdin.flush()
        return self.line()

    def line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()

    def end(self) -> None:
        self.process.kill()
        self.process.communicate()


class Motion:
    """Turns the last joint of a driver's arm, within the limits, as the loop would."""

    def __init__(self, driver: Driver) -> None:
        self.driver, self.sample = driver, driver.read()
        ((self.name, arm),) = driver.arms.items()
        start = self.sample.joints[self.name].position
        self.guard = Guard(arm, start, 1.0 / driver.inner_rate_hz)

    def go(self, rate: float, seconds: float) -> Sample:
        """Make as many ticks as there are in so many seconds, however late each is."""
        rates = np.zeros(len(self.guard.position))
        rates[-1] = rate
        for _ in range(round(seconds * self.driver.inner_rate_hz)):
            self.driver.step({self.name: self.guard.step(rates)})
            self.sample = self.driver.read()
        return self.sample
