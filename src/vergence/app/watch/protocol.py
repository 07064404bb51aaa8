"""What goes over the connection to a page.

News are one binary message: the length of a JSON text, the text, then images. The answer to a
message that cannot be obeyed is a text message of its own, to its sender alone.
"""

import json
import struct
from collections.abc import Callable
from typing import Any, NamedTuple

from vergence.app.watch.commands import Command
from vergence.app.watch.view_state import News


class Request(NamedTuple):
    """A command, and how to answer its sender if it is not executed."""

    command: Command
    refuse: Callable[[str], None]


def packed(news: News) -> bytes:
    """Return what is new as one message."""
    text: dict[str, Any] = {
        "status": news.status,
        "rows": news.rows,
        "events": news.events,
        "images": [view.header for view in news.views],
    }
    if news.about is not None:
        text["about"] = news.about
    body = json.dumps(text, separators=(",", ":"), allow_nan=False).encode()
    return struct.pack("<I", len(body)) + body + b"".join(view.jpeg for view in news.views)


def refusal(reason: str) -> str:
    """Return the answer to a message that cannot be obeyed."""
    return json.dumps({"refused": reason})
