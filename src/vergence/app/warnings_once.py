"""Warnings of the library on the command line, each printed once."""

import logging


class _Once(logging.Filter):
    """Passes a message the first time alone."""

    def __init__(self) -> None:
        super().__init__()
        self._told: set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        message = record.getMessage()
        new = message not in self._told
        self._told.add(message)
        return new


def warn_once() -> None:
    """Write warnings to stderr, without repetition; a program that has set up logging keeps its."""
    handler = logging.StreamHandler()
    handler.addFilter(_Once())
    handler.setLevel(logging.WARNING)  # some packages' loggers pass more, whatever the root says
    logging.basicConfig(format="%(message)s", level=logging.WARNING, handlers=[handler])
