"""Terminals of the card: their names, what drives each, and the signal on it."""

from __future__ import annotations

from collections.abc import Mapping

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.signals import (
    LOW,
    LineSignal,
    Signal,
    SquareWave,
    parse_square_wave,
)

__all__ = ["COUNTERS", "DEFAULT_SIGNALS", "LINES", "ON_BOARD", "PFI", "RTSI", "Terminals"]

ON_BOARD = "onboardclock"  #: the card's own clock, as the source of a task's
COUNTERS = tuple(f"ctr{i}" for i in range(4))
PFI = tuple(f"pfi{i}" for i in range(16))
RTSI = tuple(f"rtsi{i}" for i in range(8))
LINES = tuple(f"port{port}/line{line}" for port in range(3) for line in range(8))

#: Timebases that are terminals, in Hz.
_TIMEBASES = {
    "100khztimebase": 1e5, "10mhzrefclk": 1e7, "20mhztimebase": 2e7, "100mhztimebase": 1e8,
}  # fmt: skip
_TIMEBASES_WRITTEN = {
    name.lower(): name
    for name in ("100kHzTimebase", "10MHzRefClk", "20MHzTimebase", "100MHzTimebase")
}

#: What a signal generator and loose wires put on the terminals of a card, unless told otherwise.
#: The first three are apart by a quarter of a period or a factor, so that a test can tell them.
DEFAULT_SIGNALS: Mapping[str, str] = {
    "pfi0": "10 Hz",
    "pfi8": "1 kHz, 25 %",
    "pfi9": "500 Hz, 50 %, 90 deg",
    "pfi10": "500 Hz",
    # an encoder of 100 periods a second that turns forwards, with an index once a second
    "pfi3": "100 Hz",
    "pfi11": "100 Hz, 50 %, 90 deg",
    "pfi4": "1 Hz, 0.5 %",
    # port 0 reads its own outputs
    "port0/line4": "port0/line0",
    "port0/line5": "port0/line1",
    "port0/line6": "port0/line2",
    "port0/line7": "port0/line3",
}


def line_of_pfi(terminal: str) -> str:
    """Return the digital line of a PFI terminal: port1 has the first eight, port2 the others."""
    number = int(terminal[3:])
    return f"port{1 + number // 8}/line{number % 8}"


def pfi_of_line(line: str) -> str | None:
    """Return the PFI terminal of a digital line, or None for a line of port 0."""
    port, number = int(line[4]), int(line[-1])
    return None if port == 0 else f"pfi{8 * (port - 1) + number}"


class Terminals:
    """Terminals of the card ``device`` with ``signals`` wired to them.

    ``signals`` are by terminal, in lower case without the device: a square wave such as
    ``1 kHz, 25 %``, or another terminal. What the card itself drives overrides them.
    """

    def __init__(self, device: str, signals: Mapping[str, str] | None = None) -> None:
        self._device = device
        self._wired: dict[str, SquareWave | str] = {}
        for terminal, text in (DEFAULT_SIGNALS if signals is None else signals).items():
            self.wire(terminal, text)
        self.lines = {line: LineSignal() for line in LINES}
        self._driven: set[str] = set()  # lines that the program has written
        self._routes: dict[str, str] = {}  # PFI to the terminal that it puts out
        self._internal: dict[str, Signal] = {}

    def wire(self, terminal: str, text: str) -> None:
        """Put a square wave or another terminal on ``terminal``; raises ``ValueError``."""
        place = self._short(terminal)
        if place not in PFI and place not in LINES:
            raise ValueError(
                f"{terminal!r} is not a terminal for a signal; it is PFI0 to PFI15, or a line "
                "such as port0/line3"
            )
        other = self._short(text)
        known = other in PFI or other in LINES
        self._wired[place] = other if known else parse_square_wave(text)

    def provide(self, terminal: str, signal: Signal) -> None:
        """Make ``signal`` what the internal ``terminal`` has."""
        self._internal[terminal] = signal

    def name(self, text: str) -> str:
        """Return a terminal such as ``/Dev1/PFI0`` without its device, in lower case."""
        short = self._short(text)
        if not self.known(short):
            raise DaqmxError(Code.INVALID_ROUTE_SOURCE, f"Source Terminal: {text}")
        return short

    def known(self, short: str) -> bool:
        """Return True if the card has a terminal of this name."""
        return short in (*PFI, *RTSI, *LINES) or short in self._internal or short in _TIMEBASES

    def names(self) -> list[str]:
        """Return the full names of the terminals for signals; lines of port 0 are none."""
        return [self.full(name) for name in (*PFI, *RTSI, *self._internal, *_TIMEBASES)]

    def full(self, short: str) -> str:
        """Return a terminal as NI writes it, such as ``/Dev1/PFI0`` or ``/Dev1/ai/SampleClock``."""
        if not short:
            return ""
        name = short.upper() if short in PFI or short in RTSI else _TIMEBASES_WRITTEN.get(short, "")
        if not name:
            name = short.replace("ctr", "Ctr")
            for part in ("SampleClock", "StartTrigger", "ReferenceTrigger", "InternalOutput"):
                name = name.replace(part.lower(), part)
        return f"/{self._device}/{name}"

    def _short(self, text: str) -> str:
        short = text.strip().lower().lstrip("/")
        owner, slash, rest = short.partition("/")
        if slash and owner == self._device.lower():
            return rest
        if text.strip().startswith("/") and slash:
            raise DaqmxError(Code.INVALID_ROUTE_SOURCE, f"Source Terminal: {text}")
        return short

    # sources of clocks and triggers, of which the card's own clock is one

    def pin(self, text: str) -> str:
        """Return a terminal such as ``/Dev1/PFI0`` without its device, in lower case, unchecked."""
        short = text.strip().lower()
        if short.startswith("/"):
            owner, _, short = short[1:].partition("/")
            if owner != self._device.lower():
                raise DaqmxError(Code.INVALID_ROUTE_SOURCE, f"Source Terminal: {text}")
        return short

    def source(self, text: str) -> str:
        """Return a terminal such as ``/Dev1/ao/SampleClock`` without its device, in lower case."""
        return ON_BOARD if self.pin(text) == ON_BOARD else self.name(text)

    def full_source(self, text: str) -> str:
        """Return the full name of a source, such as ``/Dev1/PFI0`` for ``pfi0``."""
        short = self.source(text)
        return f"/{self._device}/OnboardClock" if short == ON_BOARD else self.full(short)

    # who drives what

    def drive(self, line: str) -> LineSignal:
        """Return a line that the program writes from now on."""
        self._driven.add(line)
        return self.lines[line]

    def release(self) -> None:
        """Let no line and no PFI terminal be driven any more, as after a reset."""
        self._driven.clear()
        self._routes.clear()

    def connect(self, source: str, destination: str) -> None:
        """Put the signal of ``source`` out at the PFI terminal ``destination``."""
        self._routes[self._output(destination)] = self.name(source)

    def disconnect(self, destination: str) -> None:
        """Put nothing out there any more."""
        self._routes.pop(self._output(destination), None)

    def _output(self, destination: str) -> str:
        short = self.name(destination)
        if short not in (*PFI, *RTSI):
            raise DaqmxError(Code.ROUTE_NOT_SUPPORTED, f"Destination Terminal: {destination}")
        return short

    def signal(self, terminal: str, depth: int = 0) -> Signal:
        """Return the signal on ``terminal``, which is a name in the card."""
        if depth > len(LINES):  # wires in a circle
            return LOW
        if terminal in self._internal:
            return self._internal[terminal]
        if terminal in _TIMEBASES:
            return SquareWave(_TIMEBASES[terminal])
        if terminal in self._routes:
            return self.signal(self._routes[terminal], depth + 1)
        line = line_of_pfi(terminal) if terminal in PFI else terminal
        if line in self._driven:
            return self.lines[line]
        if terminal in LINES and (pfi := pfi_of_line(terminal)) is not None:
            return self.signal(pfi, depth + 1)
        wired = self._wired.get(terminal)
        if wired is None and terminal in PFI:
            wired = self._wired.get(line)
        if isinstance(wired, str):
            return self.signal(wired, depth + 1)
        return LOW if wired is None else wired
