"""`vergence watch` as pages of other sites, and pages with wrong messages, find it."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from watched import Watched
from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException
from websockets.sync.client import ClientConnection, connect

_TIMEOUT_S = 180.0  # the first run compiles
STRANGER = "http://evil.example"
WRONG = (
    '{"do":"law","name":"zzz"}',
    '{"do":"law"}',
    '{"do":"speed","value":1e400}',
    '{"do":"speed","value":NaN}',
    '{"do":"speed","value":-1}',
    '{"do":"knob","key":"zzz","value":1}',
    '{"do":"knob","key":"gain","value":1e300}',
    '{"do":"knob","key":"' + ".".join("abcdefgh" * 6) + '","value":1}',
    '{"do":"knob","key":"kind","value":"constrained"}',
    '{"do":"grab","view":"zzz","u":0,"v":0}',
    '{"do":"grab","view":"wrist","u":1e6,"v":0}',
    '{"do":"fly"}',
    '{"do":["pause"]}',
    "[1, 2]",
    "not JSON",
    "9" * 4400,
    "[" * 4000,
    '{"do":"' + "x" * 5000 + '"}',
    "x" * 60_000,
)


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    folder = tmp_path_factory.mktemp("watch") / "run"
    still = "target.motion={kind = 'stationary'}"
    command = Watched("puma560", "--no-images", "--out", str(folder), "--set", still)
    yield command
    command.end()


class Page:
    """A page without a screen."""

    def __init__(self, line: ClientConnection) -> None:
        self.line = line
        self.refused: list[str] = []

    def status(self) -> dict[str, Any]:
        """Return the next status; refusals that come before it are kept."""
        while True:
            message = self.line.recv(_TIMEOUT_S)
            if isinstance(message, str):
                self.refused.append(json.loads(message)["refused"])
                continue
            self.line.send('{"do":"more"}')
            length = int.from_bytes(message[:4], "little")
            return dict(json.loads(message[4 : 4 + length])["status"])

    def read_on(self) -> None:
        """Read whatever comes."""
        while True:
            self.line.recv(_TIMEOUT_S)

    def wait_for(self, key: str, later_than: float) -> float:
        for _ in range(3000):
            value = float(self.status().get(key, 0.0))
            if value > later_than:
                return value
        raise AssertionError(f"{key} stays at {value}")


@pytest.fixture
def two_pages(watched: Watched) -> Iterator[tuple[Page, Page]]:
    origin = watched.address.rstrip("/")
    live = origin.replace("http", "ws") + "/live"
    with (
        connect(live, origin=origin, close_timeout=1) as first,
        connect(live, origin=origin, close_timeout=1) as second,
    ):
        yield Page(first), Page(second)


def test_no_port_answers_a_page_of_another_site(watched: Watched) -> None:
    connections = psutil.Process(watched.pid).net_connections("tcp")
    ports = {each.laddr.port for each in connections if each.status == psutil.CONN_LISTEN}
    assert watched.port in ports
    refused = (WebSocketException, OSError, EOFError)
    for port in ports:
        for path in ("/live", "/state?sid=x", "/ui?sid=x", "/drop?sid=x"):
            for own in (f"127.0.0.1:{port}", "evil.example"):
                with pytest.raises(refused):
                    connect(
                        f"ws://127.0.0.1:{port}{path}",
                        origin=STRANGER,
                        additional_headers={"Host": own},
                        open_timeout=20,
                    )


def test_the_viewer_takes_no_other_model_from_a_page(watched: Watched) -> None:
    origin = watched.address.rstrip("/")
    with pytest.raises(InvalidStatus, match="404"):
        connect(origin.replace("http", "ws") + "/drop?sid=x", origin=origin)


def test_each_wrong_message_is_answered_to_its_sender_and_the_run_continues(
    two_pages: tuple[Page, Page],
) -> None:
    other, sender = two_pages
    before = other.wait_for("time", 0.0)
    for message in WRONG:
        sender.line.send(message)
    while len(sender.refused) < len(WRONG):
        sender.status()
    assert len(sender.refused) == len(WRONG)
    assert all(len(reason) < 900 and "\n" not in reason for reason in sender.refused)
    other.wait_for("time", before + 0.3)
    assert other.refused == []


def test_a_message_too_long_for_memory_closes_the_line_of_its_sender_alone(
    two_pages: tuple[Page, Page],
) -> None:
    other, sender = two_pages
    sender.line.send("x" * 1_000_000)
    with pytest.raises(ConnectionClosed, match="1009"):
        sender.read_on()
    before = other.wait_for("time", 0.0)
    other.wait_for("time", before + 0.3)


def test_a_flood_of_messages_stops_neither_the_run_nor_another_page(
    watched: Watched, two_pages: tuple[Page, Page]
) -> None:
    other, sender = two_pages
    memory = psutil.Process(watched.pid).memory_info().rss
    before = other.wait_for("time", 0.0)
    for _ in range(500):
        sender.line.send('{"do":"fly"}')
    other.wait_for("time", before + 1.0)
    assert psutil.Process(watched.pid).memory_info().rss < memory + 50e6


def test_it_ends_well_after_all_that(watched: Watched) -> None:
    answer = watched.stop()
    assert answer["outcome"]["kind"] == "stopped"
    assert Path(answer["run"]).is_dir()
