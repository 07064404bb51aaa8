"""User interfaces: the command line, reports, and the live page."""

__all__: list[str] = []
