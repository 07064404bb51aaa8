"""`vergence watch` in a process of its own."""

import json
import os
import re
import signal
import subprocess
import sys
from typing import Any


class Watched:
    """The command; it listens on a free port and opens no browser."""

    def __init__(self, *arguments: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "vergence.app.main", "watch", *arguments]
            + ["--port", "0", "--no-browser", "--json"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        )
        assert self._process.stderr is not None
        self.said = ""
        for line in self._process.stderr:  # progress on a busy computer, then what it says
            self.said += line
            if "http://" in line:
                self.said += self._process.stderr.readline()
                break
        found = re.search(r"http://\S+", self.said)
        assert found, self.said + self._process.communicate(timeout=60)[1]
        self.address = found[0]

    @property
    def pid(self) -> int:
        """The process."""
        return self._process.pid

    @property
    def port(self) -> int:
        """The port of the page."""
        return int(self.address.rstrip("/").rpartition(":")[2])

    def stop(self) -> dict[str, Any]:
        """Press Ctrl-C; return the answer."""
        self._process.send_signal(signal.SIGINT)
        answer, _ = self._process.communicate(timeout=60)
        assert self._process.returncode == 0
        return dict(json.loads(answer))

    def end(self) -> None:
        """End it whatever it does."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.communicate()
