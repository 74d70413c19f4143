"""Whether the window answers in time: what was pressed while it did not is no answer to it."""

from __future__ import annotations

import time

from PySide6.QtCore import QObject, QTimer, Slot

__all__ = ["REACTION", "Responsiveness"]

#: s that a person needs to answer something seen: the mean of 1469 adults was 0.231 s (Woods et
#: al., "Factors influencing the latency of simple reaction time", Front. Hum. Neurosci. 9:131,
#: 2015). A shorter pause hides nothing that could have been answered.
REACTION = 0.25
_BEAT = 100  # ms


class Responsiveness(QObject):
    """Watches the event loop of the interface thread.

    A key or click that is handled while ``now`` is True was made at most 2 ``REACTION`` before:
    neither the pause before the last beat nor that after it was longer than ``REACTION``. The time
    stamps of the events say less: on Windows they are those of their reading.
    """

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._last = _now()  # of the beats
        self._doubtful = 0.0  # until then what waited during a pause may still come
        self._beats = QTimer(self, interval=_BEAT)
        self._beats.timeout.connect(self._beat)
        self._beats.start()

    @property
    def now(self) -> bool:
        """True where the window has answered in time up to this moment."""
        now = _now()
        return now - self._last <= REACTION and now >= self._doubtful

    @Slot()
    def _beat(self) -> None:
        now = _now()
        if now - self._last > REACTION:
            self._doubtful = now + REACTION
        self._last = now


def _now() -> float:
    return time.monotonic()
