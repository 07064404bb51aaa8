"""What goes over the line to a page: the length of a JSON text, the text, then pictures."""

import json
import struct
from typing import Any

from vergence.app.watch.board import News


def packed(news: News) -> bytes:
    """Return what is new as one message."""
    text: dict[str, Any] = {
        "status": news.status,
        "rows": news.rows,
        "events": news.events,
        "pictures": [shot.header for shot in news.shots],
    }
    if news.about is not None:
        text["about"] = news.about
    body = json.dumps(text, separators=(",", ":"), allow_nan=False).encode()
    return struct.pack("<I", len(body)) + body + b"".join(shot.jpeg for shot in news.shots)
