"""`vergence watch`: a page in the browser that shows a cell while it runs, or a recording."""

from vergence.app.watch.command import watch

__all__ = ["watch"]
