"""A link between a run and its card that can be cut, delayed, corrupted or slowed down."""

from __future__ import annotations

import random
import socket
import threading
import time
from types import TracebackType

__all__ = ["MODES", "Link"]

#: What the link does with the bytes: forwards all immediately; closes its connections; drops all
#: and keeps the connections open; forwards all 3 s later; changes one byte in a thousand; forwards
#: one byte in 20 ms.
MODES = ("whole", "cut", "silent", "delayed", "corrupted", "trickling")

_DELAY = 3.0  # s, longer than any deadline of a call
_CHANGED = 1000  # one byte in so many
_TRICKLE = 0.02  # s a byte
_POLL = 0.05  # s; how soon a thread that waits sees another mode


class Link:
    """A context with a ``port`` on the loopback that leads to ``server_port``; set its ``mode``."""

    def __init__(self, server_port: int, seed: int) -> None:
        self.mode = "whole"
        self._server_port = server_port
        self._random = random.Random(seed)  # noqa: S311
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(_POLL)  # a close does not wake up a thread that waits
        self.port: int = self._listener.getsockname()[1]
        self._sockets: list[socket.socket] = []
        self._ended = threading.Event()
        self._threads = [threading.Thread(target=self._accept, daemon=True)]

    def __enter__(self) -> Link:
        self._threads[0].start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._ended.set()
        self._threads[0].join(1.0)
        self._listener.close()
        self._close_all()
        for thread in self._threads[1:]:
            thread.join(_DELAY + 1.0)
        for one in self._sockets:
            one.close()

    def set_mode(self, mode: str) -> None:
        """Treat what passes from now on as ``mode`` says."""
        self.mode = mode
        if mode == "cut":
            self._close_all()

    def _close_all(self) -> None:
        for one in self._sockets:
            try:
                one.shutdown(socket.SHUT_RDWR)
            except OSError:
                continue  # its other end was faster

    def _accept(self) -> None:
        while not self._ended.is_set():
            try:
                here, _ = self._listener.accept()
            except TimeoutError:
                continue
            if self.mode == "cut":
                here.close()
                continue
            try:
                there = socket.create_connection(("127.0.0.1", self._server_port))
            except OSError:  # the server is gone
                here.close()
                continue
            for one in (here, there):
                one.settimeout(None)
                one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._sockets += [here, there]
            for source, target in ((here, there), (there, here)):
                thread = threading.Thread(target=self._pump, args=(source, target), daemon=True)
                self._threads.append(thread)
                thread.start()

    def _pump(self, source: socket.socket, target: socket.socket) -> None:
        try:
            while (data := source.recv(65536)) and not self._ended.is_set():
                self._pass_on(data, target)
        except OSError:
            pass  # the connection is closed: the other direction is closed below
        for one in (source, target):
            try:
                one.shutdown(socket.SHUT_RDWR)
            except OSError:
                continue

    def _pass_on(self, data: bytes, target: socket.socket) -> None:
        while self.mode == "silent" and not self._ended.is_set():
            time.sleep(_POLL)
        match self.mode:
            case "delayed":
                self._ended.wait(_DELAY)
            case "corrupted":
                changed = bytearray(data)
                for at in range(self._random.randrange(_CHANGED), len(changed), _CHANGED):
                    changed[at] ^= 1 << self._random.randrange(8)
                data = bytes(changed)
            case "trickling":
                for at in range(len(data)):
                    target.sendall(data[at : at + 1])
                    if self._ended.wait(_TRICKLE):
                        return
                return
        target.sendall(data)
