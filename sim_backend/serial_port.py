"""Simulated serial port: a pseudo-terminal where the system has them, else a loopback port."""

from __future__ import annotations

import os
import select
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from dearig.sim_backend.clock import Clock, PacedClock
from dearig.sim_backend.serial_line import Responder

__all__ = ["serve_on_pty", "serve_on_socket"]

_LONGEST_WAIT = 3600.0  # s


@contextmanager
def serve_on_socket(responder: Responder, clock: Clock | None = None) -> Iterator[str]:
    """Serve ``responder`` at a loopback port while the body runs.

    Yields its name for pyserial, ``socket://127.0.0.1:PORT``. Callers are served one at a time.
    """
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = f"socket://127.0.0.1:{listener.getsockname()[1]}"
        with _thread(_Calls(responder, clock or PacedClock(), listener)):
            yield address


@contextmanager
def serve_on_pty(
    responder: Responder, clock: Clock | None = None, baud_rate: int | None = None
) -> Iterator[str]:
    """Serve ``responder`` on a pseudo-terminal while the body runs; yields its name.

    With ``baud_rate``, bytes of a caller that sets another rate arrive garbled, as on a real line.
    Raises ``OSError`` on Windows, which has no pseudo-terminals; ``serve_on_socket`` works
    everywhere.
    """
    if sys.platform == "win32":
        raise OSError("Windows has no pseudo-terminals of this kind; use a loopback port")
    import pty
    import termios
    import tty

    # both ends stay open here, so that callers can connect again
    ours, theirs = pty.openpty()
    try:
        os.set_blocking(ours, False)
        tty.setraw(theirs)  # an instrument's line does not echo

        def same_speed() -> bool:
            set_by_caller = termios.tcgetattr(theirs)[5]
            return baud_rate is None or set_by_caller == getattr(termios, f"B{baud_rate}")

        with _thread(_Line(responder, clock or PacedClock(), ours, same_speed)):
            yield os.ttyname(theirs)
    finally:
        os.close(ours)
        os.close(theirs)


class _Served:
    """A loop in a thread that carries bytes until it is closed."""

    def __init__(self, responder: Responder, clock: Clock) -> None:
        self._responder = responder
        self._clock = clock
        # select on Windows takes sockets only
        self._woken, self._tell = socket.socketpair()

    def end(self) -> None:
        """Make the loop end. Any thread may call it."""
        self._tell.send(b"x")

    def close(self) -> None:
        """Release the loop's resources, after it has ended."""
        self._woken.close()
        self._tell.close()

    def run(self) -> None:
        """Carry bytes until ``end`` is called."""
        raise NotImplementedError

    def _wait(self, *sources: socket.socket | int) -> list[socket.socket | int] | None:
        """Return the readable sources, none where a reply is due, or None to end the loop."""
        due = self._responder.next_due()
        seconds = _LONGEST_WAIT if due is None else max(0.0, due - self._clock.now())
        ready, _, _ = select.select([self._woken, *sources], [], [], seconds)
        return None if self._woken in ready else ready


class _Calls(_Served):
    """Service of callers at a listening socket."""

    def __init__(self, responder: Responder, clock: Clock, listener: socket.socket) -> None:
        super().__init__(responder, clock)
        self._listener = listener

    def run(self) -> None:
        """Serve one caller after another."""
        while (ready := self._wait(self._listener)) is not None:
            if not ready:  # a reply to a caller that has disconnected
                self._responder.due(self._clock.now())
                continue
            caller, _ = self._listener.accept()
            with caller:
                if not self._serve(caller):
                    return

    def _serve(self, caller: socket.socket) -> bool:
        """Serve until the caller disconnects; returns False to end the loop."""
        while (ready := self._wait(caller)) is not None:
            try:
                if ready:
                    data = caller.recv(4096)
                    if not data:
                        return True
                    self._responder.receive(data, self._clock.now())
                caller.sendall(self._responder.due(self._clock.now()))
            except ConnectionError:  # the caller disconnected during a reply
                return True
        return False


class _Line(_Served):
    """The instrument's end of a pseudo-terminal."""

    def __init__(
        self, responder: Responder, clock: Clock, line: int, same_speed: Callable[[], bool]
    ) -> None:
        super().__init__(responder, clock)
        self._line = line
        self._same_speed = same_speed

    def run(self) -> None:
        """Serve the program that opens the other end."""
        while (ready := self._wait(self._line)) is not None:
            if ready:
                self._responder.receive(self._carried(os.read(self._line, 4096)), self._clock.now())
            data = self._carried(self._responder.due(self._clock.now()))
            # bytes that no one reads from a serial line are lost
            with suppress(BlockingIOError):
                while data:
                    data = data[os.write(self._line, data) :]

    def _carried(self, data: bytes) -> bytes:
        """Return ``data`` as received: another baud rate corrupts its bits."""
        return data if self._same_speed() else bytes(byte ^ 0x55 | 0x80 for byte in data)


@contextmanager
def _thread(served: _Served) -> Iterator[None]:
    thread = threading.Thread(target=served.run, name="simulated serial port", daemon=True)
    thread.start()
    try:
        yield
    finally:
        served.end()
        thread.join()
        served.close()
