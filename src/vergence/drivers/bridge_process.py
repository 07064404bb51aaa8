"""A bridge to a library of another Python, in its process."""

import os
import signal
import socket
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

from vergence.drivers.socket_robot import Link, LinkBrokenError, decode, encode
from vergence.errors import DriverSilent, InputError

_PROGRAM = (
    "import sys; sys.path.insert(0, sys.argv[1]); "
    "from importlib import import_module; import_module(sys.argv[3]).main(int(sys.argv[2]))"
)
_LONGEST = 1 << 26  # bytes of a message: an image of the largest camera
_START_S = 30.0  # for Python and the library to start
_END_S = 5.0  # for the bridge to end in order, such as to brake an arm
_CRASH_S = 0.5  # for the system to clear up after a process that has hung up already


def check_python(python: str, module: str, place: tuple[str, str], install: str) -> None:
    """Refuse an interpreter that does not run or has no such module, which is not imported.

    Args:
        python: the interpreter.
        module: which the bridge needs.
        place: source and key of the interpreter, for messages.
        install: which Python has it, for messages.

    Raises:
        InputError: if it cannot run the bridge.
    """
    program = "import sys, importlib.util as i; sys.exit(i.find_spec(sys.argv[1]) is None)"
    arguments = [str(Path(python).expanduser()), "-c", program, module]
    try:
        ended = subprocess.run(arguments, capture_output=True, timeout=_START_S, check=False)
        fault = f"has no {module}" if ended.returncode else ""
    except OSError as error:
        fault = f"does not run ({error.strerror})"
    except subprocess.TimeoutExpired:
        fault = "does not start"
    if fault:
        raise InputError(*place, f"{python}, which {fault}", install)


class BridgeProgram(NamedTuple):
    """A program of `vergence.drivers.bridges`."""

    folder: Path  # where the package `bridges` is
    name: str  # of the program's package in it
    library: str  # that it is the bridge to, for messages
    install: str  # which Python has that, for messages


class BridgeProcess:
    """Starts a bridge with the Python that has its library, and waits for what it has found.

    The bridge has a session of its own, so that Ctrl-C does not end it before it has cleared up.

    Args:
        program: the bridge.
        python: the interpreter.
        place: source and key of the interpreter, for messages.
        settings: for the bridge.
        connect_s: for it to find what it is the bridge to.

    Raises:
        InputError: if that Python does not run, or lacks the library.
        DriverSilent: if the bridge finds nothing; the message is its own.
    """

    def __init__(
        self,
        program: BridgeProgram,
        python: str,
        place: tuple[str, str],
        settings: dict[str, Any],
        connect_s: float,
    ) -> None:
        self._program, self._python, self._place = program, python, place
        ours, theirs = socket.socketpair()
        interpreter = str(Path(python).expanduser())
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed by `close`
        module = f"{program.folder.name}.{program.name}.main"
        arguments = [interpreter, "-c", _PROGRAM, str(program.folder.parent)]
        arguments += [str(theirs.fileno()), module]
        try:
            self._process = subprocess.Popen(
                arguments,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=self._errors,
                pass_fds=[theirs.fileno()],
                start_new_session=True,
                env=os.environ | {"PYTHONUNBUFFERED": "1"},
            )
        except OSError as error:
            ours.close()
            self._errors.close()
            given = f"{python}, which does not run ({error.strerror})"
            raise InputError(*place, given, program.install) from error
        finally:
            theirs.close()
        self.link = Link(ours, _LONGEST)
        try:
            self.found = self._find(settings, connect_s)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Hang up, so that the bridge ends, and wait until it has."""
        self.link.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_END_S)
        self._process.kill()
        self._process.wait()
        self._errors.close()

    def killed_by(self) -> str:
        """Return the name of the signal that ended a bridge that has hung up; empty if none did."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_CRASH_S)
        code = self._process.returncode
        return signal.Signals(-code).name if code is not None and code < 0 else ""

    def _find(self, settings: dict[str, Any], connect_s: float) -> dict[str, Any]:
        """Return what the bridge has found."""
        python, allowed = self._python, self._program.install
        deadline = monotonic() + _START_S + connect_s
        try:
            self.link.send([encode(settings)], _START_S)
            message = self.link.receive(deadline - monotonic())
        except LinkBrokenError as error:
            given = f"{python}, which does not run the bridge ({self._last_error()})"
            raise InputError(*self._place, given, allowed) from error
        if message is None:
            silent_s, library = _START_S + connect_s, self._program.library
            raise DriverSilent(f"the bridge to {library} said nothing for {silent_s:g} s")
        found = decode(message)
        if "cannot" in found:
            given = f"{python}, which cannot run the bridge ({found['cannot']})"
            raise InputError(*self._place, given, allowed)
        if "refused" in found:
            raise DriverSilent(str(found["refused"]))
        return found

    def _last_error(self) -> str:
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else "it closed the connection"
