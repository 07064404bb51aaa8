"""Recordings that were damaged, or made up by somebody who means no good."""

import tracemalloc
import warnings
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import made_up_run
import numpy as np
import pytest
import zstandard
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from untrusted import ends_well, mutants

from vergence.app.report import make_report
from vergence.app.watch.playback import Playback
from vergence.errors import InputError
from vergence.places import RECORDING
from vergence.runtime.recording import Recording

# A report takes a second: fewer of them, and a failure is shown as it was found.
few = settings(
    max_examples=settings.default.max_examples // 10, phases=(Phase.reuse, Phase.generate)
)
Change = Callable[[str, bytes], bytes]  # of the data of a message, by its topic


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = made_up_run.record(tmp_path_factory.mktemp("good"), duration=0.4)
    return (folder / RECORDING).read_bytes()


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("mutant") / RECORDING


def rewritten(good: bytes, change: Change) -> bytes:
    """Return a recording with its messages, and the texts of its metadata, changed."""
    out, reader = BytesIO(), make_reader(BytesIO(good))
    writer = Writer(out, compression=CompressionType.NONE)
    writer.start()
    for record in reader.iter_metadata():
        texts = {key: change(key, text.encode()) for key, text in record.metadata.items()}
        words = {key: text.decode(errors="ignore") for key, text in texts.items()}
        if record.name == "vergence":
            writer.add_metadata(record.name, words)
        else:
            end = words
    channels: dict[str, int] = {}
    for schema, channel, message in reader.iter_messages():
        assert schema is not None
        if channel.topic not in channels:
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            encoding = channel.message_encoding
            channels[channel.topic] = writer.register_channel(channel.topic, encoding, number)
        data = change(channel.topic, message.data)
        writer.add_message(channels[channel.topic], message.log_time, data, message.publish_time)
    writer.add_metadata("outcome", end)
    writer.finish()
    return out.getvalue()


def use(file: Path) -> Recording:
    """Do with a recording what every command does."""
    recording = Recording.open(file)
    for camera in recording.cameras:
        recording.image_times(camera)
        for _ in recording.images(camera):
            pass
    playback = Playback(recording, None) if recording.arms else None
    if playback is not None:
        playback.rows()
        for time in (0.0, 0.2, 1e9):
            playback.views(time)
            playback.state(time)
    return recording


@given(st.data())
def test_a_mutant_is_read_as_far_as_it_goes_or_refused_in_one_sentence(
    good: bytes, file: Path, data: st.DataObject
) -> None:
    file.write_bytes(data.draw(mutants(good)))
    ends_well(lambda: use(file))


@given(st.data())
def test_so_is_one_whose_messages_are_mutants(good: bytes, file: Path, data: st.DataObject) -> None:
    topics = ("info", "text", "summary", "kind", "time", *TOPICS)
    file.write_bytes(rewritten(good, data.draw(changes(good, topics))))
    ends_well(lambda: use(file))


@few
@given(st.data())
def test_what_can_be_read_can_be_reported(good: bytes, file: Path, data: st.DataObject) -> None:
    file.write_bytes(rewritten(good, data.draw(changes(good, ("info", "summary", *TOPICS)))))
    recording = ends_well(lambda: use(file))
    if recording is not None:
        with warnings.catch_warnings():  # numbers that no robot has cannot be drawn well
            warnings.simplefilter("ignore")
            ends_well(lambda: make_report(recording))


TOPICS = (
    "/arm/puma/state",
    "/camera/wrist/features",
    "/camera/wrist/image",
    "/target",
    "/events",
)


@st.composite
def changes(draw: st.DrawFn, good: bytes, topics: tuple[str, ...]) -> Change:
    """A change of a few messages on one topic."""
    chosen = draw(st.sampled_from(topics))
    seen: list[bytes] = []

    def note(topic: str, message: bytes) -> bytes:
        if topic == chosen:
            seen.append(message)
        return message

    rewritten(good, note)
    mutated = {
        number: draw(mutants(seen[number]))
        for number in draw(st.lists(st.integers(0, max(len(seen) - 1, 0)), max_size=3))
        if seen
    }
    counts = iter(range(1_000_000))

    def change(topic: str, message: bytes) -> bytes:
        return mutated.get(next(counts), message) if topic == chosen else message

    return change


def without_change(topic: str, message: bytes) -> bytes:
    return message


def test_a_rewritten_recording_is_the_same(good: bytes, file: Path) -> None:
    file.write_bytes(rewritten(good, without_change))
    again = Recording.open(file)
    assert again.complete
    assert again.skipped == 0
    assert len(again.cameras["wrist"].time) == 12
    assert len(again.image_times("wrist")) == 6
    assert make_report(again)


def test_a_message_that_cannot_be_read_is_skipped_and_counted(good: bytes, file: Path) -> None:
    seen: list[str] = []

    def change(topic: str, message: bytes) -> bytes:
        seen.append(topic)
        second = topic == "/arm/puma/state" and seen.count(topic) == 2
        return b"{" if second else message

    file.write_bytes(rewritten(good, change))
    recording = Recording.open(file)
    assert recording.skipped == 1
    assert len(recording.arms["puma"].time) == 11
    assert "1 message could not be read" in make_report(recording)


@pytest.mark.parametrize(
    "message",
    [
        b'{"time": 1, "received": 1, "u": [' + b"0," * 2_000_000 + b"0]}",
        b'{"time": 1e30, "received": 1}',
        b'{"time": null, "received": 1}',
        b'{"received": 1}',
        b'{"time": ' + b"9" * 5000 + b', "received": 1}',
        b"[" * 100_000,
        b'{"time": 1, "received": 1, "u": {"a": 1}}',
    ],
)
def test_a_message_larger_than_any_run_writes_is_skipped(
    good: bytes, file: Path, message: bytes
) -> None:
    seen: list[str] = []

    def change(topic: str, data: bytes) -> bytes:
        seen.append(topic)
        second = topic == "/camera/wrist/features" and seen.count(topic) == 2
        return message if second else data

    file.write_bytes(rewritten(good, change))
    assert len(use(file).cameras["wrist"].time) == 11


def _record(opcode: int, body: bytes) -> bytes:
    return bytes([opcode]) + len(body).to_bytes(8, "little") + body


def bomb(size: int, said: int) -> bytes:
    """Return a chunk of so many zeros that says it has so many."""
    packed = zstandard.ZstdCompressor().compress(bytes(size))
    head = np.array([0, 0, said], dtype="<u8").tobytes() + bytes(4)
    kind = b"zstd"
    return _record(
        0x06,
        head + len(kind).to_bytes(4, "little") + kind + len(packed).to_bytes(8, "little") + packed,
    )


@pytest.mark.parametrize(("size", "said"), [(1 << 29, 1 << 29), (1 << 29, 1 << 10), (100, 1 << 62)])
def test_a_bomb_is_where_the_readable_part_ends(
    good: bytes, file: Path, size: int, said: int
) -> None:
    body = rewritten(good, without_change)
    begin = 8 + len(_head(body))
    file.write_bytes(body[:begin] + bomb(size, said) + body[begin:])
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="does not begin as one"):
            Recording.open(file)
        assert tracemalloc.get_traced_memory()[1] < 50e6
    finally:
        tracemalloc.stop()


def _head(body: bytes) -> bytes:
    """Return the header record, with which a file begins."""
    length = int.from_bytes(body[9:17], "little")
    return body[8 : 17 + length]


def test_a_number_without_end_is_no_message() -> None:
    from vergence.runtime.recording import wire

    with pytest.raises(ValueError, match="64 bits"):
        wire.fields(b"\x80" * 1_000_000)


@pytest.mark.parametrize(
    "data", [b"", b"\0", b"x" * 1000, b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" + b"\xff" * 100]
)
def test_what_is_no_recording_is_refused(file: Path, data: bytes) -> None:
    file.write_bytes(data)
    with pytest.raises(InputError, match="a run's recording"):
        Recording.open(file)


def test_anything_may_be_named_anything(tmp_path: Path) -> None:
    odd: dict[str, Any] = dict.fromkeys(("$\\bad{$", "<b>", "a/b", "\n"), made_up_run.CAMERA)
    from vergence.runtime import ArmInfo, Recorder, RunInfo

    limits = np.ones(2)
    arms = {"$\\bad{$": ArmInfo(("$\\bad{$", "_^{"), -limits, limits, limits)}
    recorder = Recorder(tmp_path)
    recorder.begin(RunInfo("$\\bad{$", "", None, arms, odd))
    for tick in made_up_run.ticks(duration=0.2):
        recorder.tick(made_up_run.renamed(tick, "$\\bad{$", "$\\bad{$"))
    recorder.event(0.1, "$\\bad{$", "$\\bad{$")
    recorder.close(made_up_run.COMPLETED, {"$\\bad{$": 1.0})
    recording = Recording.open(tmp_path)
    assert len(recording.arms["$\\bad{$"].time) > 3
    assert "$\\bad{$" in make_report(recording)
