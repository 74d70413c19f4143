"""Serial communication with the laser controller: one command, one reply, in bounded time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum
from typing import TypeVar

from dearig.drivers.errors import RigError
from dearig.drivers.instruments.serial_line import Port, PortError, open_serial_port
from dearig.drivers.keyence.commands import (
    AVERAGING,
    CALCULATIONS,
    COMMANDS,
    DISPLAY_UNITS,
    ERRORS,
    FILTERS,
    QUANTITIES,
    SAMPLING_US,
    STATUS_ERROR,
    SerialCommand,
)
from dearig.drivers.keyence.compare import ControllerSettings
from dearig.drivers.settings import LaserSettings

__all__ = ["Keyence", "LaserError", "NoReading", "Port", "open_port"]

_ATTEMPTS = 3
_PATIENCE = 1.0  # s; after a longer silence a command is not repeated
_LINE_MAX = 200  # bytes; the longest expected reply has 40
_QUIET_MAX = 1.0  # s to wait for the end of unexpected data
_NOISE_MAX = 20_000  # bytes of unexpected data to discard; 115200 Bd bring fewer in _QUIET_MAX
_SHOWN = 24  # bytes of unexpected data that a message shows
_VOLTS_MAX = 11.0  # V; no analog output exceeds it

T = TypeVar("T")


class LaserError(RigError):
    """Fault of the laser controller: ``what`` happened, ``advice`` what to do.

    ``code`` is the code in the controller's error reply, if there was one.
    """

    def __init__(self, what: str, advice: str, code: int | None = None) -> None:
        super().__init__(f"{what}; {advice}", code)
        self.what = what
        self.advice = advice


class NoReading(Enum):
    """Reply of the controller instead of a number."""

    OVER_RANGE = "beyond the measuring range, on its positive side"
    UNDER_RANGE = "beyond the measuring range, on its negative side"
    WAITING = "waiting for a value"
    INVALID = "no valid value: an alarm, or nothing was measured yet"


_STATES = {
    "+FFFFFFF": NoReading.OVER_RANGE,
    "-FFFFFFF": NoReading.UNDER_RANGE,
    "--------": NoReading.WAITING,
    "XXXXXXXX": NoReading.INVALID,
}


def open_port(settings: LaserSettings) -> Port:
    """Open ``settings.port``, a name such as COM3 or a URL that pyserial knows.

    Raises ``LaserError`` where the port cannot be opened.
    """
    try:
        return open_serial_port(settings.port, settings.baud_rate, "laser.port", "controller")
    except PortError as error:
        raise LaserError(error.what, error.advice) from error


class _Garbled(Exception):  # noqa: N818  (not an error of the program)
    """The received data are not a reply to the command."""

    def __init__(self, data: bytes) -> None:
        super().__init__()
        self.data = data


class Keyence:
    """Controller at the other end of ``port``; ``settings`` give its OUT and the port's settings.

    Every method raises ``LaserError`` where the controller does not reply correctly, in bounded
    time whatever the port delivers. The protocol has no checksum: a number that the line corrupts
    into another number goes unnoticed.
    """

    def __init__(
        self, port: Port, settings: LaserSettings, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._port = port
        self._settings = settings
        self._clock = clock
        self._held = b""  # received, not yet parsed
        self._unit: float | None = None  # of a value, m; None until it is read

    def __enter__(self) -> Keyence:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the port."""
        self._port.close()

    def program(self) -> int:
        """Return the number of the active program; ends a setting mode that was left on."""
        try:
            return int(self._ask("program")[0])
        except LaserError as error:
            if error.code != STATUS_ERROR:
                raise
        self._change_mode("measuring mode")
        return int(self._ask("program")[0])

    def read(self) -> float | NoReading:
        """Return the measured value in m, or the reason why there is none.

        The first call reads the unit too; the controller stops measuring for that moment.
        """
        if self._unit is None:
            with self._setting_mode():
                self._read_unit()
        (text,) = self._ask("measured value")
        if text in _STATES:
            return _STATES[text]
        return float(text) * self._known_unit()

    def controller_settings(self) -> ControllerSettings:
        """Return the controller's settings; the controller does not measure meanwhile."""
        program = self.program()
        with self._setting_mode():
            sampling = self._choice("sampling cycle", SAMPLING_US)
            kind, parameter = self._ask("filter")
            calculation = self._choice("calculation", CALCULATIONS)
            unit, step = self._read_unit()
            into1, out1, into2, out2 = self._ask("measurement scaling")
            at1, volts1, at2, volts2 = self._ask("analog scaling")
        found = ControllerSettings(
            program=program,
            sampling=sampling * 1e-6,
            filter=self._known("filter", kind, FILTERS),
            # the digit stands for a number of averages or for a cut-off frequency
            averaging=self._known("filter", parameter, AVERAGING) if kind == "0" else None,
            calculation=calculation,
            measurement_points=(
                (_scaled(into1, unit, step), _scaled(out1, unit, step)),
                (_scaled(into2, unit, step), _scaled(out2, unit, step)),
            ),
            analog_points=(
                (_scaled(at1, unit, step), _scaled(volts1, 1.0, 1e-3)),
                (_scaled(at2, unit, step), _scaled(volts2, 1.0, 1e-3)),
            ),
        )
        for name, points in (
            ("measurement scaling", found.measurement_points),
            ("analog scaling", found.analog_points),
        ):
            if points[0][0] == points[1][0] or points[0][1] == points[1][1]:
                raise LaserError(
                    f"the two points of the {name} of OUT{self._settings.output} are the same",
                    "set two different points in the controller",
                )
        if max(abs(volts) for _, volts in found.analog_points) > _VOLTS_MAX:
            raise LaserError(
                f"the analog scaling of OUT{self._settings.output} reads {volts1} and {volts2} "
                f"as volts, which no analog output has",
                "the letters may differ in this unit: compare drivers/keyence/commands.py with "
                "its manual",
            )
        return found

    # ------------------------------------------------------------ settings

    @contextmanager
    def _setting_mode(self) -> Iterator[None]:
        """Put the controller into its setting mode in the body, and measure again afterwards."""
        try:
            self._change_mode("setting mode")
            yield
        finally:
            # in any case: in its setting mode a controller holds its output and does not measure
            try:
                self._change_mode("measuring mode")
            except LaserError as error:
                raise LaserError(
                    f"the laser controller may still be in its setting mode, in which it does not "
                    f"measure: {error.what}",
                    "switch it off and on",
                    error.code,
                ) from error

    def _change_mode(self, mode: str) -> None:
        try:
            self._ask(mode)
        except LaserError as error:
            if error.code != STATUS_ERROR:  # this code: the controller is in this mode already
                raise

    def _read_unit(self) -> tuple[float, float]:
        quantity = self._choice("quantity", QUANTITIES)
        if quantity != "displacement":
            raise LaserError(
                f"OUT{self._settings.output} of the controller puts out {quantity}",
                "set it to displacement in the controller",
            )
        unit, step = self._choice("display unit", DISPLAY_UNITS)
        self._unit = unit
        return unit, step

    def _known_unit(self) -> float:
        if self._unit is None:
            raise LaserError("the unit of the values is not known", "read it first")
        return self._unit

    def _choice(self, name: str, choices: tuple[T, ...]) -> T:
        return self._known(name, self._ask(name)[0], choices)

    def _known(self, name: str, digit: str, choices: tuple[T, ...]) -> T:
        if int(digit) >= len(choices):
            raise LaserError(
                f"the controller's {name} has the number {digit}, which is not known here",
                "compare drivers/keyence/commands.py with its manual",
            )
        return choices[int(digit)]

    # ------------------------------------------------------------ one command, one reply

    def _ask(self, name: str) -> list[str]:
        """Return the values of the reply to command ``name``; a lost reply is requested again."""
        command = COMMANDS[name]
        text = command.text(self._settings.output)
        seen: bytes = b""
        try:
            for _ in range(_ATTEMPTS):
                self._drop()
                self._port.write(text.encode("ascii") + b"\r")
                try:
                    return self._values(command, text, self._line(command.timeout))
                except _Garbled as garbled:
                    seen = garbled.data or seen
                    if garbled.data:
                        self._wait_for_quiet()
                    elif command.timeout > _PATIENCE:
                        break
        except OSError as error:
            raise LaserError(
                f"serial port {self._settings.port} fails: {error}",
                "check the cable and the adapter",
            ) from error
        raise self._unanswered(text, seen)

    def _values(self, command: SerialCommand, text: str, line: bytes) -> list[str]:
        asked = text.split(",")
        fields = line.strip(b" \n").decode("ascii", "replace").upper().split(",")
        if fields[0] == "ER" and len(fields) == 3 and fields[1] in asked and fields[2].isdecimal():
            raise self._refused(text, int(fields[2]))
        count = len(command.values)
        header, values = fields[: len(fields) - count], fields[len(fields) - count :]
        # a reply repeats the command, with or without its OUT
        named = 2 if asked[0] == "SR" else 1
        if len(header) < named or header != asked[: len(header)] or len(values) != count:
            raise _Garbled(line or b"\r")
        if not all(p.fullmatch(v) for p, v in zip(command.values, values, strict=True)):
            raise _Garbled(line)
        return values

    def _line(self, timeout: float) -> bytes:
        """Return the bytes up to the next CR."""
        deadline = self._clock() + timeout
        while b"\r" not in self._held:
            if len(self._held) > _LINE_MAX or self._clock() >= deadline:
                raise _Garbled(self._held)
            self._held += self._take()
        line, _, self._held = self._held.partition(b"\r")
        return line

    def _wait_for_quiet(self) -> None:
        deadline = self._clock() + _QUIET_MAX
        left = _NOISE_MAX
        while (came := len(self._take())) and left > 0 and self._clock() < deadline:
            left -= came

    def _drop(self) -> None:
        """Discard unrequested data, such as a reply that came after its time-out."""
        self._held = b""
        if self._port.in_waiting:
            self._wait_for_quiet()

    def _take(self) -> bytes:
        return self._port.read(max(1, min(self._port.in_waiting, _LINE_MAX)))

    # ------------------------------------------------------------ reports

    def _refused(self, text: str, code: int) -> LaserError:
        meaning, advice = ERRORS.get(
            code, ("an unknown error", "look the code up in the controller's manual")
        )
        return LaserError(
            f"the laser controller refuses {text} with code {code:02d}: {meaning}", advice, code
        )

    def _unanswered(self, text: str, seen: bytes) -> LaserError:
        where = f"{self._settings.port} at {self._settings.baud_rate} Bd"
        if not seen:
            return LaserError(
                f"nothing answers {text} on {where}",
                "check that the controller is on, the cable is its own crossed one, laser.port is "
                "its port, and laser.baud_rate is the rate set in the controller",
            )
        shown = ascii(seen[:_SHOWN].decode("ascii", "backslashreplace")).replace("\\\\", "\\")
        if all(byte in b"\r\n\t" or 32 <= byte < 127 for byte in seen):
            return LaserError(
                f"the reply to {text} on {where} is {shown}, which no LK-G5000 sends",
                "check that laser.port is the controller's port: another instrument may be there",
            )
        return LaserError(
            f"the data on {where} are not text: {shown}",
            "set laser.baud_rate as in the controller; if it is, check the cable and "
            "interference from the high voltage",
        )


def _scaled(text: str, unit: float, step: float) -> float:
    """Return a setting in units if it has a decimal point, else in smallest steps."""
    return float(text) * (unit if "." in text else step)
