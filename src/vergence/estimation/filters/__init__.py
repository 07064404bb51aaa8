"""The pose filters: what they believe of a target, its motion, and how images correct it."""

__all__: list[str] = []
