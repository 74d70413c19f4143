"""Run of a campaign that goes on, on the page Campaign: its curves and its numbers."""

from __future__ import annotations

from PySide6.QtCore import Qt, QTimer, Slot
from PySide6.QtWidgets import QVBoxLayout, QWidget

from dearig.window.campaign.controls import CampaignControls
from dearig.window.high_voltage.status import HighVoltageStatus, OutputReading
from dearig.window.run.live import Live
from dearig.window.run.plots import PLOTS, RunPlots
from dearig.window.session.state import Session

__all__ = ["PresentRun"]

_FRAME = 33  # ms between two frames: half of those of the page Run, next to a table
_NUMBERS = 100  # ms between two updates of the readouts: faster ones cannot be read
_SHOWN = ("voltage", "displacement")


class PresentRun(QWidget):
    """Draws voltage and displacement of the present run; hidden before the first one.

    Its numbers go to the ``controls`` and to the ``status``, and are gone between two runs. The
    curves of the last run stay until the next one begins.
    """

    def __init__(
        self,
        session: Session,
        status: HighVoltageStatus,
        controls: CampaignControls,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._status, self._controls = status, controls
        self._live: Live | None = None
        self._drawn = -1  # revision
        self.plots = RunPlots(session)
        for name in PLOTS:
            self.plots.show_plot(name, name in _SHOWN)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.plots)
        self._frames = QTimer(self, interval=_FRAME, timerType=Qt.TimerType.PreciseTimer)
        self._frames.timeout.connect(self.draw)
        self._numbers = QTimer(self, interval=_NUMBERS)
        self._numbers.timeout.connect(self._show_numbers)
        self.hide()

    def begin(self) -> None:
        """Show the numbers of a campaign that begins."""
        self._live = None
        self._numbers.start()

    def follow(self, live: Live) -> None:
        """Draw the run of ``live`` from now on."""
        self._live, self._drawn = live, -1
        self.plots.show_prediction(None)
        self.plots.start()
        self.show()
        self._frames.start()

    def end(self) -> None:
        """Show no numbers, and draw no further frames; what is drawn stays."""
        self.draw()
        self._frames.stop()
        self._numbers.stop()
        self._controls.show_numbers(None)

    @Slot()
    def draw(self) -> None:
        """Draw a frame, if samples have come."""
        now = None if self._live is None else self._live.now()
        if self._live is None or now is None or now.revision == self._drawn:
            return
        if self.isVisible():
            self._drawn = now.revision
            self.plots.draw(self._live, now.samples / now.rate)

    @Slot()
    def _show_numbers(self) -> None:
        now = None if self._live is None or not self._status.live else self._live.now()
        if now is not None:
            monitor = now.values.get("monitor", float("nan"))
            self._status.show_reading(
                OutputReading(monitor, now.samples / now.rate, now.total / now.rate, 1.0 / now.rate)
            )
        self._controls.show_numbers(now)
