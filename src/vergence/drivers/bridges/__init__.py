"""Programs for another Python than vergence's, each in a process of its own: bridges to libraries.

Their packages are found beside each other and need nothing of vergence.
"""

__all__: list[str] = []
