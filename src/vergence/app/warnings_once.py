"""Warnings of the library on the command line, each printed once; tracebacks go to a file."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vergence.raised import raised

TRACEBACK = "traceback.txt"  # in the folder of a run


class _Once(logging.Filter):
    """Passes a message the first time alone, and none that the outcome of a run repeats."""

    def __init__(self) -> None:
        super().__init__()
        self._told: set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        message = record.getMessage()
        new = message not in self._told and not getattr(record, "in_outcome", False)
        self._told.add(message)
        return new


class _OnOneLine(logging.Formatter):
    """Writes an error's type, message and place, without its traceback."""

    def format(self, record: logging.LogRecord) -> str:
        error = record.exc_info[1] if record.exc_info else None
        message = record.getMessage()
        return message if error is None else f"{message}: {raised(error)}"


def warn_once() -> None:
    """Write warnings to stderr, without repetition; a program that has set up logging keeps its."""
    handler = logging.StreamHandler()
    handler.addFilter(_Once())
    handler.setFormatter(_OnOneLine())
    handler.setLevel(logging.WARNING)  # some packages' loggers pass more, whatever the root says
    logging.basicConfig(level=logging.WARNING, handlers=[handler])


@contextmanager
def tracebacks_in(folder: Path) -> Iterator[None]:
    """Write the tracebacks of what is logged meanwhile to a file in a folder, if there are any."""
    (folder / TRACEBACK).unlink(missing_ok=True)  # of an earlier run
    handler = logging.FileHandler(folder / TRACEBACK, delay=True)
    handler.addFilter(lambda record: bool(record.exc_info) and folder.is_dir())
    logging.getLogger().addHandler(handler)
    try:
        yield
    finally:
        logging.getLogger().removeHandler(handler)
        handler.close()
