"""Garbage is collected in the interface thread, and nowhere else.

What a window lets go of hangs together in circles, which only the collector undoes. By itself it
runs in whatever thread happens to need memory, and a part of a window that is destroyed from
another thread than its own takes the program with it: here, in the middle of a run.
"""

from __future__ import annotations

import gc

from PySide6.QtCore import QObject, QTimer, Slot

__all__ = ["Collector"]

_INTERVAL = 1000  # ms


class Collector(QObject):
    """From its making to ``close``, the only one who collects."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        gc.disable()
        gc.collect()
        gc.freeze()  # what is there from the start stays, and need not be looked at again
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.collect)
        self._timer.start(_INTERVAL)

    @Slot()
    def collect(self) -> None:
        """Collect as much as is due, as the interpreter would."""
        counts, thresholds = gc.get_count(), gc.get_threshold()
        due = [
            generation
            for generation, (count, limit) in enumerate(zip(counts, thresholds, strict=True))
            if limit and count > limit
        ]
        if due:
            gc.collect(due[-1])

    def close(self) -> None:
        """Leave it to the interpreter again."""
        self._timer.stop()
        gc.unfreeze()
        gc.enable()
