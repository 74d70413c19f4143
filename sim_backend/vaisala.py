"""Vaisala probe on its serial line: bytes in, bytes out, time as an argument.

It knows the commands that ``dearig.drivers.instruments.vaisala`` sends, in the STOP mode of a probe
of its own line, or in POLL mode where the settings have an address. The line is that of a HMP110:
temperature, relative humidity and dew point with one decimal.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from dearig.drivers.settings import ThermohygrometerSettings

__all__ = ["SimulatedProbe"]

_REPLY_DELAY = 0.02  # s
_COMMAND_MAX = 100  # bytes
# Magnus formula over water, Sonntag 1990: dew point in degrees Celsius
_MAGNUS_A, _MAGNUS_B = 17.62, 243.12


class SimulatedProbe:
    """Probe with ``settings``; see ``dearig.sim_backend.serial_line.Responder``.

    ``measured`` returns degrees Celsius and per cent, or NaN for a value that the probe cannot
    measure. While ``garbled`` returns True, bytes of its answers are noise. With ``echo`` it sends
    back what it receives, as a probe on a line of its own does by default. With ``running`` it
    sends readings unasked until it is told to stop.
    """

    def __init__(
        self,
        settings: ThermohygrometerSettings,
        measured: Callable[[], tuple[float, float]],
        *,
        seed: tuple[int, ...] = (0,),
        garbled: Callable[[], bool] = lambda: False,
        echo: bool = True,
        running: bool = False,
        silent: bool = False,
    ) -> None:
        self._address = settings.address
        self._measured = measured
        self._generator = np.random.default_rng((*seed, 7))
        self._garbled = garbled
        self._echo = echo
        self._running = running
        self._silent = silent
        self._held = b""
        self._pending: list[tuple[float, bytes]] = []

    def noise(self, count: int) -> np.ndarray:
        """Return ``count`` normal numbers of the sensor's noise."""
        return self._generator.standard_normal(count)

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes that arrived; replies to complete commands become due."""
        self._held += data
        while b"\r" in self._held:
            command, _, self._held = self._held.partition(b"\r")
            if self._silent:
                continue
            if self._echo and self._address is None:
                self._pending.append((now, command + b"\r\n"))
            words = command.decode("ascii", "replace").upper().split()
            if words == ["S"]:
                self._running = False
            elif not self._running and words == self._asked:
                self._pending.append((now + _REPLY_DELAY, self._line()))
        if len(self._held) > _COMMAND_MAX:
            self._held = b""

    def due(self, now: float) -> bytes:
        """Return the bytes sent by ``now`` that were not returned before."""
        sent = b"".join(reply for at, reply in self._pending if at <= now)
        self._pending = [(at, reply) for at, reply in self._pending if at > now]
        if self._running:
            sent += self._line()[:20]
        return sent

    def next_due(self) -> float | None:
        """Return the time in s of the next bytes to send, or None."""
        return min((at for at, _ in self._pending), default=None)

    @property
    def _asked(self) -> list[str]:
        return ["SEND"] if self._address is None else ["SEND", str(self._address)]

    def _line(self) -> bytes:
        if self._garbled():
            return self._generator.bytes(30) + b"\r\n"
        celsius, percent = self._measured()
        dew = _shown(_dew(celsius, percent))
        line = f"T= {_shown(celsius)} 'C RH= {_shown(percent)} %RH Td= {dew} 'C\r\n"
        return line.encode("ascii")


def _shown(value: float) -> str:
    return f"{value:5.1f}" if math.isfinite(value) else "***.*"


def _dew(celsius: float, percent: float) -> float:
    """Return the dew point in degrees Celsius, NaN where it is not known."""
    if not percent > 0.0:
        return math.nan
    part = math.log(percent / 100.0) + _MAGNUS_A * celsius / (_MAGNUS_B + celsius)
    return _MAGNUS_B * part / (_MAGNUS_A - part)
