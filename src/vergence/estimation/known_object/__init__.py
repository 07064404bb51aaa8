"""Following an object of known shape by its edges or its outline, and finding it again."""

__all__: list[str] = []
