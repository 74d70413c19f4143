"""Garbage collection in the interface thread only.

Widgets that are no longer used refer to each other in cycles, which only the garbage collector
frees. Python runs it in whichever thread allocates memory. Qt crashes when a widget is destroyed in
another thread than its own, and a crash during a run leaves the rig without its program.
"""

from __future__ import annotations

import gc

from PySide6.QtCore import QObject, QTimer, Slot

__all__ = ["Collector"]

_INTERVAL = 1000  # ms


class Collector(QObject):
    """Collects garbage from its creation to ``close``; Python's own collection is off meanwhile."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        gc.disable()
        self.settle()
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.collect)
        self._timer.start(_INTERVAL)

    @Slot()
    def settle(self) -> None:
        """Collect all garbage, and leave what is alive now out of later collections.

        A collection of all objects of the window takes 0.1 s, and STOP would wait for it: it is
        done before the rig is armed and after a run.
        """
        gc.unfreeze()
        gc.collect()
        gc.freeze()

    @Slot()
    def collect(self) -> None:
        """Collect the generations that are due by Python's own thresholds."""
        counts, thresholds = gc.get_count(), gc.get_threshold()
        due = [
            generation
            for generation, (count, limit) in enumerate(zip(counts, thresholds, strict=True))
            if limit and count > limit
        ]
        if due:
            gc.collect(due[-1])

    def close(self) -> None:
        """Turn Python's own collection on again."""
        self._timer.stop()
        gc.unfreeze()
        gc.enable()
