"""`vergence watch`: a page in the browser that shows a cell while it runs, or a recording."""

from vergence.app.watch.command import Request, watch

__all__ = ["Request", "watch"]
