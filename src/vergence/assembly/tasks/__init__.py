"""A loop for each kind of task, and for tasks one after the other."""

__all__: list[str] = []
