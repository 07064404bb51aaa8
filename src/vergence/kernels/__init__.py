"""Compiled kernels: where they are kept, which are ready or stale, and memory for those."""

__all__: list[str] = []
