"""Vaisala probes with a serial line: HMP60 and HMP110 series, and others with the command SEND.

One command, one line: ``SEND`` and CR, answered by ``T= 22.6 'C RH= 22.8 %RH Td= 0.3 'C`` and
CR LF. Source: Vaisala HMP110 Series User Guide, section "Serial line output commands" (S, SEND);
the user guides of HMP230, HMP240 and HMDW110 give the same command, with the values in another
order. Values that the probe cannot measure are asterisks. Units may be 'C or 'F.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable
from typing import Literal

from dearig.drivers.instruments.findings import Finding
from dearig.drivers.instruments.serial_line import Port, PortError, open_serial_port
from dearig.drivers.instruments.thermohygrometer import (
    RoomReading,
    ThermohygrometerError,
    reading_finding,
)
from dearig.drivers.settings import ThermohygrometerSettings

__all__ = ["DRIVER", "TIMEOUT", "VaisalaDriver", "VaisalaProbe"]

TIMEOUT = 1.0  #: s to wait for a line
_ATTEMPTS = 2
_LINE_MAX = 200  # bytes; the longest line of a HMP230 has 90
_NOISE_MAX = 4000  # bytes of unexpected data to discard; 19200 Bd bring 1920 in a second
_SHOWN = 40  # bytes of unexpected data that a message shows
_NUMBER = r"=?\s*(?P<{0}>[-+]?\d+(?:\.\d+)?|\*+(?:\.\*+)?)\s*"
_TEMPERATURE = re.compile(r"\bTa?\s*" + _NUMBER.format("value") + r"'(?P<unit>[CF])")
_HUMIDITY = re.compile(r"\bRH\s*" + _NUMBER.format("value") + r"%RH")
# what such a probe can measure; anything else is a garbled digit
_CELSIUS = (-80.0, 200.0)
_PERCENT = (0.0, 105.0)


class VaisalaProbe:
    """Probe at the other end of ``port``; ``clock`` returns the time in s for time-outs.

    The protocol has no checksum: a value that the line corrupts into another one that is possible
    goes unnoticed.
    """

    def __init__(
        self,
        port: Port,
        settings: ThermohygrometerSettings,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._port = port
        self._settings = settings
        self._clock = clock
        self._stopped = False

    def read(self) -> RoomReading:
        """Ask for a reading and return it; a lost or garbled line is requested again.

        Raises ``ThermohygrometerError`` where the probe does not answer, in bounded time whatever
        the port delivers.
        """
        address = self._settings.address
        command = b"SEND\r" if address is None else f"SEND {address}\r".encode()
        seen = b""
        try:
            if not self._stopped and address is None:
                # a probe in RUN mode sends without being asked, and then takes only this command
                self._port.write(b"S\r")
                self._stopped = True
            for _ in range(_ATTEMPTS):
                self._drop()
                self._port.write(command)
                deadline = self._clock() + TIMEOUT
                while (line := self._line(deadline)) is not None:
                    reading = _parsed(line)
                    if reading is not None:
                        return reading
                    words = line.strip(b" >").upper()
                    # an echo of a command, with the prompt before it, is not an answer
                    if words not in (b"", b"S", command.strip()):
                        seen = line.strip()
        except OSError as error:
            raise ThermohygrometerError(
                f"serial port {self._settings.port} fails: {error}",
                "check the cable and the adapter",
            ) from error
        raise self._unanswered(seen)

    def close(self) -> None:
        """Release the port."""
        self._port.close()

    def _drop(self) -> None:
        """Discard what came unasked, such as a reply that came after its time-out."""
        left = _NOISE_MAX
        while left > 0 and self._port.in_waiting:
            left -= len(self._port.read(min(self._port.in_waiting, _LINE_MAX)))

    def _line(self, deadline: float) -> bytes | None:
        """Return the bytes up to the next CR or LF; None at the deadline."""
        line = b""
        while self._clock() < deadline:
            byte = self._port.read(1)
            if byte in (b"\r", b"\n"):
                return line
            line = (line + byte)[-_LINE_MAX:]
        return None

    def _unanswered(self, seen: bytes) -> ThermohygrometerError:
        where = f"{self._settings.port} at {self._settings.baud_rate} Bd"
        if not seen:
            return ThermohygrometerError(
                f"no reading from {where} within {TIMEOUT:g} s",
                "check that the sensor is on, its cable, thermohygrometer.port, baud_rate and "
                "address",
            )
        shown = ascii(seen[:_SHOWN].decode("ascii", "backslashreplace")).replace("\\\\", "\\")
        return ThermohygrometerError(
            f"the answer on {where} is {shown}, which is not a reading",
            "set thermohygrometer.baud_rate as in the sensor, and its output (FORM) to values with "
            "names and units",
        )


def _parsed(line: bytes) -> RoomReading | None:
    """Return the reading in ``line``; None for a line that is none."""
    text = line.decode("ascii", "replace")
    temperature, humidity = _TEMPERATURE.search(text), _HUMIDITY.search(text)
    if temperature is None and humidity is None:
        return None
    celsius = percent = math.nan
    if temperature is not None and "*" not in temperature["value"]:
        celsius = float(temperature["value"])
        if temperature["unit"] == "F":
            celsius = (celsius - 32.0) / 1.8
    if humidity is not None and "*" not in humidity["value"]:
        percent = float(humidity["value"])
    for value, (low, high) in ((celsius, _CELSIUS), (percent, _PERCENT)):
        if math.isfinite(value) and not low <= value <= high:
            return None
    return RoomReading(celsius, percent)


def _opened(settings: ThermohygrometerSettings) -> Port:
    if not settings.port:
        raise ThermohygrometerError(
            "no serial port is in the rig file", "set thermohygrometer.port, or leave its table out"
        )
    try:
        return open_serial_port(
            settings.port, settings.baud_rate, "thermohygrometer.port", "sensor"
        )
    except PortError as error:
        raise ThermohygrometerError(error.what, error.advice) from error


class VaisalaDriver:
    """Driver of these probes; see ``ThermohygrometerDriver``.

    ``opener`` opens the serial port; ``clock`` returns the time in s for time-outs.
    """

    role: Literal["thermohygrometer"] = "thermohygrometer"

    def __init__(
        self,
        opener: Callable[[ThermohygrometerSettings], Port] = _opened,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._opener = opener
        self._clock = clock

    def open(self, settings: ThermohygrometerSettings) -> VaisalaProbe:
        """Return the probe at ``settings.port``. Raises ``ThermohygrometerError``."""
        return VaisalaProbe(self._opener(settings), settings, self._clock)

    def inspect(self, settings: ThermohygrometerSettings) -> tuple[Finding, ...]:
        """Return whether the probe answers, and its reading against the limits."""
        try:
            probe = self.open(settings)
            try:
                reading = probe.read()
            finally:
                probe.close()
        except ThermohygrometerError as error:
            broken = Finding(
                settings.model, "serial port", error.what,
                verdict="warning" if settings.on_loss == "go on" else "wrong",
                advice=error.advice,
            )  # fmt: skip
            return (broken,)
        answers = f"answers on {settings.port} at {settings.baud_rate} Bd"
        return Finding(settings.model, "serial port", answers), reading_finding(settings, reading)


#: Entry of the registry.
DRIVER = VaisalaDriver()
