"""What a person sees: the command line, the report."""

__all__: list[str] = []
