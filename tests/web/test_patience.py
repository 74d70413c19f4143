"""Connections that never send a whole request keep no one out, with or without a token."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path

import pytest

pytest.importorskip("uvicorn", reason='takes the extra "web"')

from dearig.batch.watching import SourceWatch
from dearig.web import patience
from dearig.web.server import WatchServer

HALF = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: "
ANSWERS_WITHIN = 60.0  # s, on a machine that is busy


@pytest.fixture
def port(tmp_path: Path) -> Iterator[int]:
    server = WatchServer(SourceWatch(tmp_path), "127.0.0.1", 0, None, 0.1)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        yield server.port
    finally:
        server.stop()
        thread.join()


def status(port: int) -> int:
    connection = HTTPConnection("127.0.0.1", port, timeout=ANSWERS_WITHIN)
    try:
        connection.request("GET", "/")
        return connection.getresponse().status
    finally:
        connection.close()


def half_sent(port: int) -> socket.socket:
    found = socket.create_connection(("127.0.0.1", port), ANSWERS_WITHIN)
    found.sendall(HALF)
    return found


def ended(one: socket.socket) -> bool:
    """Wait until the server has ended the connection."""
    try:
        return one.recv(1) == b""
    except ConnectionResetError:
        return True


def test_a_half_sent_request_is_ended_and_others_are_answered(port, monkeypatch) -> None:
    monkeypatch.setattr(patience, "HEADER_S", 0.2)
    with half_sent(port) as slow, socket.create_connection(("127.0.0.1", port)) as silent:
        assert ended(slow)
        silent.settimeout(ANSWERS_WITHIN)
        assert ended(silent)
    assert status(port) == 200
    # after an answer the time runs again
    with socket.create_connection(("127.0.0.1", port), ANSWERS_WITHIN) as kept:
        kept.sendall(b"GET /icon.svg HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" + HALF)
        while kept.recv(4096):
            pass


def test_two_hundred_half_sent_requests_of_one_address_end_at_its_number(port, monkeypatch) -> None:
    monkeypatch.setattr(patience, "WAITING_MAX", 5)
    many = [half_sent(port) for _ in range(5)]
    with half_sent(port) as sixth:
        assert ended(sixth)
    many.pop().close()
    answered = False
    while not answered:  # the server hears of the closed one in its own time
        try:
            answered = status(port) == 200
        except ConnectionError:
            continue
    for one in many:
        one.close()
