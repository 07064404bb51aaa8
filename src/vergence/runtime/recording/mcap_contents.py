"""Reads an MCAP file from front to back, and as far as it goes where it was cut."""

import logging
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

_LOG = logging.getLogger(__name__)


@dataclass(slots=True)
class McapContents:
    """All of a file but its pictures."""

    metadata: dict[str, dict[str, str]] = field(default_factory=dict)  # by name
    messages: dict[str, list[bytes]] = field(default_factory=dict)  # by topic, in order
    complete: bool = False  # whether the file ends as it should

    @classmethod
    def read(cls, path: Path, leave_out: str) -> Self:
        """Read a file, leaving out topics that end in `leave_out`."""
        from mcap.records import Footer, Metadata

        contents = cls()
        for topic, record in _records(path):
            if topic is not None and not topic.endswith(leave_out):
                contents.messages.setdefault(topic, []).append(record.data)
            elif isinstance(record, Metadata):
                contents.metadata[record.name] = record.metadata
            elif isinstance(record, Footer):
                contents.complete = True
        return contents


def messages_on(path: Path, topic: str) -> Iterator[bytes]:
    """Yield the messages on one topic, in order."""
    for on, record in _records(path):
        if on == topic:
            yield record.data


def _records(path: Path) -> Iterator[tuple[str | None, Any]]:
    """Yield every record, messages with their topic; the first that cannot be read is the end."""
    from mcap.records import Channel, Message
    from mcap.stream_reader import StreamReader

    topics: dict[int, str] = {}
    with path.open("rb") as stream:
        try:
            for record in StreamReader(stream).records:
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                yield topics[record.channel_id] if isinstance(record, Message) else None, record
        except Exception as error:  # a cut can look like anything to a parser
            _LOG.info("%s cannot be read to its end: %r", path, error)
