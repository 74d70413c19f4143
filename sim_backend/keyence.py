"""LK-G5000 laser controller on its serial line: bytes in, bytes out, time as an argument.

It knows only the commands that ``dearig.drivers.keyence`` sends, and takes their letters from the
same table. It therefore tests the driver's behaviour, not whether the table is right.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from enum import StrEnum

from dearig.drivers.keyence.commands import AVERAGING, SAMPLING_US
from dearig.drivers.settings import LaserSettings
from dearig.sim_backend.faults import FaultKind, FaultPlan

__all__ = ["Behaviour", "SimulatedController"]

_REPLY_DELAY = 0.003  # s
_COMMAND_MAX = 200  # bytes
_UNIT = 1  # number of the display unit: 0.001 mm, with a range of +-999.999 mm


class Behaviour(StrEnum):
    """Behaviour of the instrument at the end of the line."""

    CONTROLLER = "controller"
    SILENT = "silent"
    OTHER = "other"  # another instrument, with its own replies to everything
    BABBLING = "babbling"  # sends without a pause, unasked


class SimulatedController:
    """Controller with the settings of ``settings``, for the OUT that they name.

    ``reading`` returns the measured value in m at a time, or None where the target is out of
    range. Faults of ``SERIAL_GARBAGE`` replace replies with noise while they last; ``seed`` seeds
    the noise. A change of mode takes ``mode_change`` s.
    """

    def __init__(
        self,
        settings: LaserSettings,
        reading: Callable[[float], float | None],
        *,
        behaviour: Behaviour = Behaviour.CONTROLLER,
        faults: FaultPlan | None = None,
        seed: int = 0,
        mode_change: float = 0.6,
    ) -> None:
        self.setting_mode = False
        self._mode_change = mode_change
        self._settings = settings
        self._reading = reading
        self._behaviour = behaviour
        self._faults = (faults or FaultPlan()).of(FaultKind.SERIAL_GARBAGE)
        self._noise = random.Random(seed)  # noqa: S311  (noise on a line, no secret)
        self._held = b""
        self._pending: list[tuple[float, bytes]] = []

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes that arrived; replies to complete commands become due."""
        self._held += data
        while b"\r" in self._held:
            command, _, self._held = self._held.partition(b"\r")
            reply, delay = self._reply(command.decode("ascii", "replace").upper(), now)
            if self._garbled(now):
                reply = self._noise.randbytes(self._noise.randrange(1, 40))
            self._pending.append((now + delay, reply))
        if len(self._held) > _COMMAND_MAX:
            self._held = b""

    def due(self, now: float) -> bytes:
        """Return the bytes sent by ``now`` that were not returned before."""
        sent = b"".join(reply for at, reply in self._pending if at <= now)
        self._pending = [(at, reply) for at, reply in self._pending if at > now]
        if self._behaviour is Behaviour.BABBLING:
            sent += self._noise.randbytes(64).replace(b"\r", b"\n")
        return sent

    def next_due(self) -> float | None:
        """Return the time in s of the next bytes to send, or None."""
        return min((at for at, _ in self._pending), default=None)

    def _garbled(self, now: float) -> bool:
        return any(fault.at <= now < fault.end for fault in self._faults)

    def _reply(self, command: str, now: float) -> tuple[bytes, float]:
        """Return the reply to a command, and its delay in s."""
        if self._behaviour in (Behaviour.SILENT, Behaviour.BABBLING):
            return b"", 0.0
        if self._behaviour is Behaviour.OTHER:
            return b"?SYNTAX\r\n", _REPLY_DELAY
        delay = self._mode_change if command in ("Q0", "R0") else _REPLY_DELAY
        main, *parameters = command.split(",")
        answer = self._answer(main, parameters, now)
        if isinstance(answer, int):
            return f"ER,{main},{answer:02d}\r".encode(), _REPLY_DELAY
        return ",".join(answer).encode() + b"\r", delay

    def _answer(self, main: str, parameters: list[str], now: float) -> list[str] | int:
        """Return the fields of the reply, or an error code."""
        if main in ("Q0", "R0"):
            wanted = main == "Q0"
            if parameters:
                return 61
            if self.setting_mode is wanted:
                return 51
            self.setting_mode = wanted
            return [main]
        if main not in ("PR", "MS", "SR"):
            return 50
        if self.setting_mode is not (main == "SR"):
            return 51
        if main == "SR":
            return self._setting(parameters)
        if main == "PR":
            return 61 if parameters else ["PR", "0"]
        if len(parameters) != 1:
            return 61
        if parameters[0] != f"{self._settings.output:02d}":
            return 62
        return [main, *parameters, self._value(now)]

    def _value(self, now: float) -> str:
        """Return the measured value as text: a sign and seven characters."""
        seen = self._reading(now)
        if seen is None:
            return "XXXXXXXX"
        if abs(seen) > self._settings.range_mm * 1e-3:
            return "+FFFFFFF" if seen > 0.0 else "-FFFFFFF"
        return self._number(seen)

    def _number(self, metres: float) -> str:
        return f"{metres * 1e3:+08.3f}"

    def _setting(self, parameters: list[str]) -> list[str] | int:
        settings = self._settings
        # scaling points at the ends of the range, as an operator would set them
        far = settings.mm_per_V * 1e-3 * settings.analog_range_V
        volts = settings.direction * settings.analog_range_V
        of_out = {
            "OB": ["+000.000", "+000.000", "+100.000", "+100.000"],
            "OC": ["0", str(AVERAGING.index(settings.averaging))],
            "OD": ["0"],
            "OG": [str(_UNIT)],
            "OH": [self._number(-far), f"{-volts:+08.4f}", self._number(far), f"{volts:+08.4f}"],
            "OI": ["0"],
        }
        of_all = {"CA": [str(self._sampling())]}
        match parameters:
            case [name] if name in of_all:
                return ["SR", name, *of_all[name]]
            case [name, out] if name in of_out:
                if out != f"{settings.output:02d}":
                    return 62
                return ["SR", name, out, *of_out[name]]
            case [name, *_] if name in of_all or name in of_out:
                return 61
            case _:
                return 50

    def _sampling(self) -> int:
        """Return the number of the offered sampling cycle nearest to the one in the settings."""
        nearest = min(SAMPLING_US, key=lambda cycle: abs(cycle - self._settings.sampling_us))
        return SAMPLING_US.index(nearest)
