"""The processes that share out a campaign's runs, as somebody else on this machine finds them."""

import logging
import socket
import ssl

import psutil
import pytest

from vergence.experiments import Executor

WEB = b"GET /status HTTP/1.1\r\nHost: localhost\r\n\r\n"


def listening() -> set[tuple[str, int]]:
    """Return where this process and its children listen."""
    this = psutil.Process()
    found = set()
    for process in (this, *this.children(recursive=True)):
        for each in process.net_connections("inet"):
            if each.status == psutil.CONN_LISTEN:
                found.add((each.laddr.ip, each.laddr.port))
    return found


def answer(port: int, *, encrypted: bool, words: bytes) -> bytes:
    """Return what a port says to somebody without a certificate."""
    with socket.create_connection(("127.0.0.1", port), timeout=3) as plain:
        if not encrypted:
            plain.sendall(words)
            return plain.recv(1000)
        context = ssl.create_default_context()
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        with context.wrap_socket(plain) as line:
            line.sendall(words)
            return line.recv(1000)


def is_refused(port: int, *, encrypted: bool) -> bool:
    """Whether a port says nothing, or that there is no such page."""
    try:
        said = answer(port, encrypted=encrypted, words=WEB)
    except (OSError, ssl.SSLError):
        return True
    return said == b"" or said.startswith(b"HTTP/1.1 404")


def complain() -> None:
    """Warn of a cell, as its model does whenever it is read."""
    logging.getLogger("vergence.robot").warning("this arm has no meshes")


def test_workers_leave_warnings_to_the_process_that_shares_out_the_runs(
    capfd: pytest.CaptureFixture[str],
) -> None:
    with Executor(workers=2)._client(1) as client:
        client.submit(complain).result()
    assert capfd.readouterr().err == ""


def test_workers_hear_nobody_without_their_certificate_and_show_no_pages() -> None:
    before = listening()
    with Executor(workers=2)._client(2) as client:
        assert client.submit(sum, (1, 2)).result() == 3
        assert client.scheduler.address.startswith("tls://127.0.0.1:")
        opened = listening() - before
        assert len(opened) >= 4
        assert {ip for ip, _ in opened} == {"127.0.0.1"}
        for _, port in opened:
            assert is_refused(port, encrypted=True), port
            assert is_refused(port, encrypted=False), port
