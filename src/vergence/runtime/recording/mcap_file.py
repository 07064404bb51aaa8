"""Writes an MCAP file, with a channel per topic that is opened on first use."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import foxglove
import foxglove.channels
import foxglove.mcap

from vergence.runtime.json_numbers import dumps
from vergence.runtime.recording.messages import nanoseconds


class McapFile:
    """Writes messages by topic; `flush` makes all previous ones readable."""

    def __init__(self, path: Path) -> None:
        self._context = foxglove.Context()
        self._channels: dict[str, Any] = {}
        # Chunks are small: compressing them in other threads would cost more than it saves.
        options = foxglove.mcap.MCAPWriteOptions(compression_threads=0)
        self._writer = foxglove.open_mcap(
            path, allow_overwrite=True, context=self._context, writer_options=options
        )

    def numbers(
        self, topic: str, time: float, schema: dict[str, Any], message: Mapping[str, Any]
    ) -> None:
        """Write a JSON message."""
        channel = self._channels.get(topic)
        if channel is None:
            channel = foxglove.Channel(topic, schema=schema, context=self._context)
            self._channels[topic] = channel
        channel.log(dumps(message), log_time=nanoseconds(time))

    def typed(self, topic: str, time: float, message: object) -> None:
        """Write a message of one of Foxglove's types."""
        channel = self._channels.get(topic)
        if channel is None:
            kind = getattr(foxglove.channels, f"{type(message).__name__}Channel")
            channel = kind(topic, context=self._context)
            self._channels[topic] = channel
        channel.log(message, log_time=nanoseconds(time))

    def metadata(self, name: str, words: dict[str, str]) -> None:
        """Write named metadata of the file."""
        self._writer.write_metadata(name, words)

    def flush(self) -> None:
        """Finish the current chunk and pass it to the operating system."""
        self._writer.flush()

    def close(self) -> None:
        """Write the index and close the file."""
        self._writer.close()
