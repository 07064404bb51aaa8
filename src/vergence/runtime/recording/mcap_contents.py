"""Reads an MCAP file from front to back, up to the point where it is cut off or damaged.

No size in the file is trusted: no record is longer than the rest of the file, no chunk is
decompressed to more than its stated size, and all of them together to no more than a recording of
that length can hold.
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Self

_LOG = logging.getLogger(__name__)

_MOST_RECORD = 1 << 28  # bytes
_MOST_UNPACKED = 1 << 28  # bytes of one chunk; the writer makes chunks of 1 MB
_MOST_RATIO = 200  # decompressed to compressed size of the file; JSON numbers shrink to a tenth
_SPARE = 1 << 24  # bytes to which a short file may be decompressed in any case
_MOST_METADATA = 1 << 22  # characters
_MOST_MESSAGES = 5_000_000  # ten arms and cameras for some hours


@dataclass(slots=True)
class McapContents:
    """The contents of a file except its images."""

    metadata: dict[str, dict[str, str]] = field(default_factory=dict)  # by name
    messages: dict[str, list[bytes]] = field(default_factory=dict)  # by topic, in order
    complete: bool = False  # whether the file has a proper end

    @classmethod
    def read(cls, path: Path, leave_out: str) -> Self:
        """Read a file except the topics that end in `leave_out`."""
        from mcap.records import Footer, Metadata

        contents = cls()
        for topic, record in _records(path):
            if topic is not None and not topic.endswith(leave_out):
                contents.messages.setdefault(topic, []).append(record.data)
            elif isinstance(record, Metadata) and len(contents.metadata) < 100:
                contents.metadata[record.name] = record.metadata
            elif isinstance(record, Footer):
                contents.complete = True
        return contents


def messages_on(path: Path, topic: str) -> Iterator[bytes]:
    """Yield the messages on one topic, in order."""
    for on, record in _records(path):
        if on == topic:
            yield record.data


class _DamagedError(Exception):
    """The rest of the file cannot be read."""


class _RestOfFile:
    """Limits reads to the size of a file, whatever lengths the file states."""

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file, self._left = file, size

    def read(self, length: int) -> bytes:
        data = self._file.read(min(length, self._left))
        self._left -= len(data)
        return data


def _records(path: Path) -> Iterator[tuple[str | None, Any]]:
    """Yield every record, messages with their topic, up to the first that cannot be read."""
    from mcap.records import Channel, Message

    topics: dict[int, str] = {}
    messages = 0
    size = path.stat().st_size
    with path.open("rb") as file:
        try:
            for record in _unpacked(_RestOfFile(file, size), size):
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                topic = topics[record.channel_id] if isinstance(record, Message) else None
                messages += topic is not None
                if messages > _MOST_MESSAGES:
                    raise _DamagedError(f"more than {_MOST_MESSAGES} messages")
                yield topic, record
        except Exception as error:  # data that is cut off may make the parser raise anything
            _LOG.info("%s cannot be read to its end: %r", path, error)


def _unpacked(stream: Any, size: int) -> Iterator[Any]:
    """Yield the records of a file of a given size, including those in chunks."""
    from mcap.records import Chunk, Metadata
    from mcap.stream_reader import StreamReader, breakup_chunk

    left = _MOST_RATIO * size + _SPARE
    reader = StreamReader(stream, emit_chunks=True, record_size_limit=_MOST_RECORD)
    for record in reader.records:
        if isinstance(record, Chunk):
            data = _decompressed(record, min(left, _MOST_UNPACKED))
            left -= len(data)
            record.data, record.compression = data, ""
            yield from breakup_chunk(record)
        elif isinstance(record, Metadata):
            if sum(map(len, record.metadata.values())) > _MOST_METADATA:
                raise _DamagedError("metadata of megabytes")
            yield record
        else:
            yield record


def _decompressed(chunk: Any, most: int) -> bytes:
    """Return the data of a chunk.

    Raises:
        _DamagedError: if it would exceed `most` bytes, or has a compression that recordings do not
            use.
    """
    import zstandard

    if chunk.compression == "":
        return bytes(chunk.data)
    if chunk.compression != "zstd" or chunk.uncompressed_size > most:
        raise _DamagedError(f"a chunk of {chunk.uncompressed_size} bytes, {chunk.compression!r}")
    with zstandard.ZstdDecompressor(max_window_size=1 << 27).stream_reader(chunk.data) as stream:
        data = bytes(stream.read(chunk.uncompressed_size))
    if len(data) != chunk.uncompressed_size:
        raise _DamagedError("a chunk shorter than it says")
    return data
