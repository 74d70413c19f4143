"""Ctrl-C during a run: handled between two blocks, so that no block is lost."""

from __future__ import annotations

import signal
import threading
import weakref
from collections.abc import Callable
from types import FrameType

__all__ = [
    "Interrupts",
    "ends_program",
    "ignore_interrupts",
    "interrupted",
    "note_interrupts",
    "raise_interrupt",
    "terminal_closed",
]

# the voltage must not stay on when a terminal is closed or a service stopped
_REASONS = {
    "SIGINT": "by the operator",
    "SIGTERM": "by the signal SIGTERM, which asks a program to end",
    "SIGHUP": "because the terminal was closed",
    "SIGBREAK": "by the operator",
}
_OPERATOR, _CLOSED = _REASONS["SIGINT"], _REASONS["SIGHUP"]

_Handler = Callable[[int, FrameType | None], object] | int | None

_runs: weakref.WeakSet[Interrupts] = weakref.WeakSet()


_ends_program = False


def ends_program() -> None:
    """Let the end of a run by ctrl-C be the end of this program: further ones are ignored."""
    global _ends_program
    _ends_program = True


_pressed = False


def note_interrupts() -> None:
    """Note each ctrl-C outside a run, which raises as before.

    Compiled code, such as that of libraries while they are imported, can drop the exception, or
    wrap it into another one. No run starts after it.
    """
    if (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) == signal.default_int_handler
    ):
        signal.signal(signal.SIGINT, _note)


def _note(number: int, frame: FrameType | None) -> None:  # noqa: ARG001
    global _pressed
    _pressed = True
    raise KeyboardInterrupt


def interrupted() -> bool:
    """Return True if ctrl-C was noted outside a run."""
    return _pressed


def raise_interrupt() -> None:
    """Raise ``KeyboardInterrupt`` if one was noted outside a run."""
    if _pressed:
        raise KeyboardInterrupt


def ignore_interrupts() -> None:
    """Ignore ctrl-C from now on, so that the last sentence is written."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def terminal_closed() -> None:
    """End the run of this program, if there is one: no one sees what it says any more.

    Nothing happens where the signal of a closed terminal is ignored, as under ``nohup``.
    """
    hangup = getattr(signal, "SIGHUP", None)
    if hangup is not None and signal.getsignal(hangup) == signal.SIG_IGN:
        return
    for run in list(_runs):
        run.ask(_CLOSED)


class Interrupts:
    """A context in which the first ctrl-C sets ``asked`` and the second raises.

    An exception at the first ctrl-C could come between the reading and the writing of a block, and
    the samples around the ramp to 0 V would be lost. The second ends a run on a rig that does not
    answer. A terminal that is closed sends its signal more than once: it counts once. Handlers that
    a host program has set stay, and ignored signals stay ignored. Outside the main thread nothing
    is installed, because signals are not delivered there. A ctrl-C that was noted before
    (``note_interrupts``) is raised when the context is entered.
    """

    def __init__(self) -> None:
        self._asked = self._at_once = False
        self._raises = True
        self._reason = _OPERATOR
        self._count = 0
        self._before: dict[int, _Handler] = {}

    @property
    def reason(self) -> str:
        """Who or what asked first, as in "interrupted by the operator"."""
        return self._reason

    @property
    def by_operator(self) -> bool:
        """True if the operator asked first."""
        return self._reason == _OPERATOR

    @property
    def count(self) -> int:
        """Number of times that the operator has asked; a closed terminal does not count."""
        return self._count

    def asked(self) -> bool:
        """Return whether the run is to end."""
        return self._asked

    def ask(self, reason: str = _OPERATOR) -> None:
        """Ask for the end of the run, as the first ctrl-C does; may be called from any thread."""
        if not self._asked:
            self._reason = reason
        self._asked = True
        if reason != _CLOSED:
            self._count += 1

    def ask_at_once(self) -> None:
        """Ask for 0 V at once, without a ramp; may be called from any thread."""
        self.ask()
        self._at_once = True

    def at_once(self) -> bool:
        """Return whether the run is to end without a ramp."""
        return self._at_once

    def close(self) -> None:
        """Stop raising: the rig is being made safe, and an exception would delay that."""
        self._raises = False

    def __enter__(self) -> Interrupts:
        """Install the handlers."""
        _runs.add(self)
        if threading.current_thread() is threading.main_thread():
            for name in _REASONS:
                number = getattr(signal, name, None)
                if number is None:
                    continue
                before = signal.getsignal(number)
                if before in (signal.SIG_DFL, signal.default_int_handler, _note):
                    self._before[number] = before
                    signal.signal(number, self._handle)
        if _pressed:  # looked at last: from here on a press is asked, not noted
            self.__exit__()
            raise KeyboardInterrupt
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the handlers that were there before."""
        _runs.discard(self)
        for number, before in self._before.items():
            # ctrl-C that is held down must not break off what follows: the rig is closed, and the
            # operator is told of its output
            ignored = _ends_program and self._asked and number == signal.SIGINT
            signal.signal(number, signal.SIG_IGN if ignored else before)

    def _handle(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002
        again, reason = self._asked, _REASONS[signal.Signals(number).name]
        self.ask(reason)
        if again and reason != _CLOSED and self._raises:
            self._raises = False
            raise KeyboardInterrupt
