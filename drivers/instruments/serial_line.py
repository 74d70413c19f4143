"""Serial ports: opening one, with what to do where that fails."""

from __future__ import annotations

import errno
import sys
from typing import Protocol

__all__ = ["POLL", "Port", "PortError", "open_serial_port"]

POLL = 0.05  #: s that one read of the port waits


class Port(Protocol):
    """Interface of a serial port, which pyserial's ports have. Faults are ``OSError``.

    ``read`` returns the bytes that arrive within ``POLL`` s, up to ``size`` of them, or none.
    """

    @property
    def in_waiting(self) -> int:
        """Return the number of bytes that can be read at once."""
        ...

    def read(self, size: int = 1, /) -> bytes:
        """Read."""
        ...

    def write(self, data: bytes, /) -> object:
        """Write all of ``data``."""
        ...

    def close(self) -> None:
        """Release the port."""
        ...


class PortError(Exception):
    """Port that cannot be opened: ``what`` happened, ``advice`` what to do."""

    def __init__(self, what: str, advice: str) -> None:
        super().__init__(f"{what}; {advice}")
        self.what = what
        self.advice = advice


def open_serial_port(name: str, baud_rate: int, key: str, instrument: str) -> Port:
    """Open port ``name``, such as COM3, or a URL that pyserial knows, at ``baud_rate`` Bd.

    ``key`` is the key of the rig file that names it, ``instrument`` what is at its other end; both
    are for messages. Raises ``PortError`` where the port cannot be opened.
    """
    try:
        import serial
    except ModuleNotFoundError as error:
        raise PortError(
            "pyserial, which speaks to serial ports, is not installed",
            'pip install "dearig[rig]"',
        ) from error
    try:
        port: Port = serial.serial_for_url(
            name, baudrate=baud_rate, timeout=POLL, write_timeout=1.0, exclusive=True
        )
    except (OSError, ValueError) as error:
        raise _cannot_open(name, key, instrument, error) from error
    return port


def _cannot_open(name: str, key: str, instrument: str, error: Exception) -> PortError:
    from serial.tools.list_ports import comports

    # on Windows only the text gives the cause
    text, number = str(error), getattr(error, "errno", None)
    denied = number == errno.EACCES or "PermissionError" in text
    if number == errno.ENOENT or "FileNotFoundError" in text:
        there = ", ".join(sorted(port.device for port in comports())) or "none"
        return PortError(
            f"there is no serial port {name}",
            f"set {key} to where the {instrument} is; serial ports here: {there}",
        )
    if number in (errno.EBUSY, errno.EAGAIN) or (denied and sys.platform == "win32"):
        return PortError(f"serial port {name} is in use", "close the program that uses it")
    if denied:
        return PortError(
            f"this user may not open serial port {name}",
            "join the group that owns it, often dialout, and log in again",
        )
    return PortError(
        f"serial port {name} cannot be opened: {text}",
        f"set {key} to the name of a serial port, such as COM3 or /dev/ttyUSB0",
    )
