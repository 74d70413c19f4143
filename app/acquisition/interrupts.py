"""Ctrl-C during a run: handled between two blocks, so that no block is lost."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import FrameType, TracebackType

__all__ = ["Interrupts"]

# the voltage must not stay on when a terminal is closed or a service stopped
_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")

_Handler = Callable[[int, FrameType | None], object] | int | None


class Interrupts:
    """A context in which the first ctrl-C sets ``asked`` and the second raises.

    An exception at the first ctrl-C could come between the reading and the writing of a block, and
    the samples around the ramp to 0 V would be lost. The second ends a run on a rig that does not
    answer. Handlers that a host program has set stay, and ignored signals stay ignored. Outside
    the main thread nothing is installed, because signals are not delivered there.
    """

    def __init__(self) -> None:
        self._asked = self._at_once = False
        self._raises = True
        self._before: dict[int, _Handler] = {}

    def asked(self) -> bool:
        """Return whether the run is to end."""
        return self._asked

    def ask(self) -> None:
        """Ask for the end of the run, as the first ctrl-C does; may be called from any thread."""
        self._asked = True

    def ask_at_once(self) -> None:
        """Ask for 0 V at once, without a ramp; may be called from any thread."""
        self._asked = self._at_once = True

    def at_once(self) -> bool:
        """Return whether the run is to end without a ramp."""
        return self._at_once

    def close(self) -> None:
        """Stop raising: the rig is being made safe, and an exception would delay that."""
        self._raises = False

    def __enter__(self) -> Interrupts:
        """Install the handlers."""
        if threading.current_thread() is threading.main_thread():
            for name in _NAMES:
                number = getattr(signal, name, None)
                if number is None:
                    continue
                before = signal.getsignal(number)
                if before in (signal.SIG_DFL, signal.default_int_handler):
                    self._before[number] = before
                    signal.signal(number, self._handle)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Restore the handlers that were there before."""
        for number, before in self._before.items():
            signal.signal(number, before)

    def _handle(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002
        if self._asked and self._raises:
            self._raises = False
            raise KeyboardInterrupt
        self._asked = True
