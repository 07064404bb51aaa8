"""Both ends of the example's socket, and what may come over it."""

import fcntl
import json
import resource
import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from untrusted import mutants

from vergence.camera import Camera
from vergence.drivers import Equipment
from vergence.drivers.socket_robot import Link, LinkBrokenError, SocketDriver, read_answer
from vergence.errors import DriverSilent

ANSWER = json.dumps(
    {
        "period": 3,
        "setpoints": {"puma": [[0.1, -2.0], [0.0, 1e-3]]},
        "outputs": {"grip": 0.5},
    }
).encode()
STATE = json.dumps(
    {
        "period": 4,
        "time": 0.25,
        "joints": {"puma": [[0.1, -2.0], [0.0, 1e-3]]},
        "images": [["wrist", 0.2]],
    }
).encode()
ARM: Any = SimpleNamespace(joint_count=2)
LONGEST = 1 << 16


def framed(message: bytes) -> bytes:
    return len(message).to_bytes(4, "big") + message


@contextmanager
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        near = socket.create_connection(listener.getsockname())
        far, _ = listener.accept()
    with near, far:
        yield near, far


@given(mutants(ANSWER))
def test_a_set_point_is_one_or_breaks_the_link(message: bytes) -> None:
    try:
        period, setpoints, outputs = read_answer(message, 5, {"puma": ARM}, ("grip",))
    except LinkBrokenError:
        return
    assert 0 <= period <= 5
    assert all(0.0 <= value <= 1.0 for value in outputs.values())
    for setpoint in setpoints.values():
        assert setpoint.position.shape == setpoint.velocity.shape == (2,)
        assert np.isfinite(setpoint.position + setpoint.velocity).all()


@given(st.lists(st.binary(max_size=300), max_size=5), st.integers(1, 50))
def test_messages_come_as_they_were_sent_in_whatever_pieces(
    sent: Sequence[bytes], size: int
) -> None:
    with pair() as (near, far):
        link = Link(near, LONGEST)
        data = b"".join(map(framed, sent))
        for start in range(0, len(data), size):
            far.sendall(data[start : start + size])
        assert [link.receive(5.0) for _ in sent] == list(sent)
        assert link.receive(0.0) is None


def test_a_link_works_in_a_process_with_thousands_of_open_files() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    with pair() as (near, far):
        link = Link(socket.socket(fileno=fcntl.fcntl(near, fcntl.F_DUPFD, 2000)), LONGEST)
        try:
            assert link.receive(0.01) is None
            far.sendall(framed(STATE))
            assert link.receive(5.0) == STATE
            link.send([STATE], 1.0)
            assert far.recv(len(STATE) + 4, socket.MSG_WAITALL) == framed(STATE)
        finally:
            link.close()
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    with pytest.raises(LinkBrokenError, match="is closed"):
        link.receive(0.0)


@given(mutants(framed(STATE) + framed(bytes(12)) + framed(STATE)))
def test_whatever_the_robot_says_is_a_state_or_a_silent_driver(data: bytes) -> None:
    with pair() as (near, far):
        far.sendall(data)
        far.close()
        _read_on(near)


def _read_on(near: socket.socket) -> None:
    cameras = {"wrist": Camera(4, 3, 5.0, 5.0, 1.5, 1.0)}
    equipment = Equipment("", {"puma": ARM}, cameras, 500.0)
    try:
        driver = SocketDriver(Link(near, LONGEST), equipment, 0.2)
    except DriverSilent:
        return
    for _ in range(2):
        try:
            driver._receive()
        except DriverSilent:
            break
        sample = driver.read()
        assert np.isfinite(sample.joints["puma"].position).all()
        assert all(frame.image.shape == (3, 4) for frame in sample.frames)
