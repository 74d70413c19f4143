"""An interrupt (ctrl-C) that a callback of a library could not raise: it is raised later."""

from __future__ import annotations

import threading

__all__ = ["note_lost", "raise_lost"]

_lost = threading.Event()


def note_lost() -> None:
    """Note that Python has dropped a ``KeyboardInterrupt``."""
    _lost.set()


def raise_lost() -> None:
    """Raise the ``KeyboardInterrupt`` that was dropped, if one was."""
    if _lost.is_set():
        _lost.clear()
        raise KeyboardInterrupt
