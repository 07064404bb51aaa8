"""What ends a bridge."""


class GoneError(Exception):
    """The robot cannot be reached, or does not take the connection; the text says why."""
