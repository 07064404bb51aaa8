"""What a law and an arm cannot do, told before anything moves."""

__all__: list[str] = []
