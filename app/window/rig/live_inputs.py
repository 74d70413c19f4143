"""Live values of a rig at rest: every input with its noise and its trace; nothing is output."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from PySide6.QtCore import QEvent, Qt, QTimer, Signal, Slot
from PySide6.QtGui import QHideEvent
from PySide6.QtWidgets import QHBoxLayout, QTableWidget, QTableWidgetItem, QVBoxLayout, QWidget

from dearig.acquisition.inputs import open_inputs
from dearig.drivers.channels import COUNT_MAX, COUNT_MIN, Channel
from dearig.drivers.errors import RigError
from dearig.drivers.inputs import Inputs
from dearig.errors import DearigError
from dearig.output_state import Known, OutputState
from dearig.report.text.numbers import significant
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import Message, button, number_text
from dearig.window.plots.area import PlotArea
from dearig.window.run.channel_plots import ChannelPlots
from dearig.window.run.traces import Newest, Pyramid
from dearig.window.session.state import Session

__all__ = ["LiveInputs"]

log = logging.getLogger(__name__)

_SPAN = 10.0  # s of the traces
_NOISE_OVER = 1.0  # s over which value and noise are taken
_SILENT = 1.0  # s without a sample after which no number is shown
_REPORT_EVERY = 1.0  # s between two states of the output for the window's bar
_IDLE = "Inputs are read at rest. Nothing is written to an output."
_NAMES = {
    "voltage_monitor": "Voltage monitor",
    "current_monitor": "Current monitor",
    "displacement": "Laser, not zeroed",
    "temperature": "Temperature",
}
_ZERO_CELSIUS = 273.15  # K


class _Shown(NamedTuple):
    """How values of an SI unit and their noise are shown: factors, units, and what is taken off."""

    factor: float
    unit: str
    noise_factor: float
    noise_unit: str
    zero: float = 0.0


_UNITS = {
    "V": _Shown(1e-3, "kV", 1.0, "V"),
    "A": _Shown(1e3, "mA", 1e6, "µA"),
    "m": _Shown(1e3, "mm", 1e6, "µm"),
    "K": _Shown(1.0, "°C", 1e3, "mK", _ZERO_CELSIUS),
}


class _Signal:
    """One channel: its newest second, and its trace."""

    def __init__(self, channel: Channel, rate: float) -> None:
        self.channel = channel
        self.label = channel.label or _NAMES.get(channel.name, channel.name)
        # the unit of a declared channel is the operator's own
        shown = _UNITS.get(channel.unit) if channel.name in _NAMES else None
        self.shown = shown or _Shown(1.0, channel.unit, 1.0, channel.unit)
        self._second = max(2, round(_NOISE_OVER * rate))
        self.newest = Newest(self._second)
        self.trace = Pyramid(round(_SPAN * rate))
        self.at_end = False

    def push(self, counts: np.ndarray) -> None:
        values = self.channel.scaling.physical(counts)
        self.newest.push(values)
        self.trace.push((values - self.shown.zero) * self.shown.factor)
        self.at_end = bool(np.any((counts == COUNT_MIN) | (counts == COUNT_MAX)))

    def last(self) -> np.ndarray:
        """Return the values of the newest second in SI units."""
        return self.newest.last(self._second)


class LiveInputs(QWidget):
    """Reads the inputs of the session's rig from a click until anything else begins.

    It stops with an arming, a run, another rig or rig file, and when it is no longer shown; then
    it shows no numbers. The state of the output that its voltage monitor shows goes to the session.
    """

    reading_changed = Signal(bool)
    _opened = Signal(int, object, float)  # number of the reading, channels, Hz
    _arrived = Signal(int, object)
    _ended = Signal(int, str)

    def __init__(
        self,
        session: Session,
        parent: QWidget | None = None,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._clock = clock
        self._number = 0  # of the reading that counts; what an earlier one sends is dropped
        self._end: threading.Event | None = None  # of the present reading
        self._threads: dict[int, threading.Thread] = {}
        self.signals: list[_Signal] = []
        self._rate = 0.0
        self._samples = 0
        self._last_sample = self._last_report = 0.0
        self._silence = QTimer(self, interval=250)
        self._silence.timeout.connect(self._check_silence)
        self._build()
        queued = Qt.ConnectionType.QueuedConnection
        self._opened.connect(self._show_channels, queued)
        self._arrived.connect(self._take, queued)
        self._ended.connect(self._reading_ended, queued)
        session.rig_changed.connect(self.stop)
        session.armed_changed.connect(self._busy_changed)
        session.running_changed.connect(self._busy_changed)

    @property
    def reading(self) -> bool:
        """True from ``start`` to ``stop`` or a fault."""
        return self._end is not None

    @Slot()
    def start(self) -> None:
        """Read the inputs of the session's rig; nothing happens while it is armed or plays."""
        if self.reading or self._session.busy:
            return
        self._number += 1
        self._end = end = threading.Event()
        address, rig_file = self._session.address, self._session.rig_file
        self._thread(self._number, end, lambda: open_inputs(address, rig_file))
        self.message.show_text(f"Opening the inputs of {address} …", "muted")
        self._show_reading()

    @Slot()
    def stop(self) -> None:
        """End the reading and show no numbers; ``wait`` waits until the rig is free."""
        if self._end is None:
            return
        self._end.set()
        self._end = None
        self._number += 1
        self._clear()
        self.message.show_text(_IDLE, "muted")
        self._show_reading()

    def wait(self) -> None:
        """Wait until no reading has the rig any more. May be called in another thread."""
        for thread in tuple(self._threads.values()):
            thread.join()

    def close_work(self) -> None:
        """End the reading, and wait for its thread."""
        self.stop()
        self.wait()

    def hideEvent(self, event: QHideEvent) -> None:  # noqa: N802
        """Stop: nothing is read that is not looked at."""
        super().hideEvent(event)
        self.stop()

    # the reading

    def _thread(self, number: int, end: threading.Event, opening: Callable[[], Inputs]) -> None:
        before = tuple(self._threads.values())

        def read() -> None:
            for thread in before:  # the card is free only after them
                thread.join()
            sentence = ""
            try:
                inputs = opening()
                try:
                    self._opened.emit(number, inputs.channels, inputs.rate)
                    while not end.is_set():
                        self._arrived.emit(number, inputs.read())
                finally:
                    inputs.close()
            except (DearigError, RigError) as error:
                sentence = str(error)
            except Exception:
                log.exception("the inputs could not be read")
                sentence = "an error in the program; the log has its details"
            self._ended.emit(number, sentence)

        thread = threading.Thread(target=read, name="live inputs", daemon=True)
        self._threads[number] = thread
        thread.start()

    @Slot(int, str)
    def _reading_ended(self, number: int, sentence: str) -> None:
        thread = self._threads.pop(number, None)
        if thread is not None:
            thread.join()
        if number == self._number and self._end is not None:
            self.stop()
            self.message.show_text(f"Stopped: {sentence}", "bad")

    @Slot(bool)
    def _busy_changed(self, busy: bool) -> None:
        if busy:
            self.stop()
        self._show_reading()

    @Slot(int, object, float)
    def _show_channels(self, number: int, channels: tuple[Channel, ...], rate: float) -> None:
        if number != self._number:
            return
        self._rate, self._samples, self._last_sample = rate, 0, self._clock()
        self.signals = [_Signal(channel, rate) for channel in channels]
        self.plots.show_channels([(s.label, s.shown.unit) for s in self.signals])
        self.area.set_live(live=True)
        self.table.setRowCount(len(self.signals))
        for row, signal in enumerate(self.signals):
            for column, text in enumerate((signal.label, "—", "—")):
                item = QTableWidgetItem(text)
                if column:
                    item.setTextAlignment(
                        Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
                    )
                self.table.setItem(row, column, item)
        self._fit_table()
        self._silence.start()
        self.message.show_text(
            f"Reading {self._session.address} at {rate:g} Hz; value and noise (standard "
            f"deviation) of the last second",
            "good",
        )

    @Slot(int, object)
    def _take(self, number: int, counts: np.ndarray) -> None:
        if number != self._number or not counts.shape[1]:
            return
        self._last_sample = self._clock()
        self._samples += counts.shape[1]
        now = self._samples / self._rate
        for place, (signal, row) in enumerate(zip(self.signals, counts, strict=True)):
            signal.push(row)
            values = signal.last()
            self._show_values(place, float(values.mean()), float(values.std()))
            first = max(0, self._samples - round(_SPAN * self._rate))
            at, trace = signal.trace.view(first, self._samples)
            self.plots.curves[place].set_points(at / self._rate, trace, thinned=True)
        self.area.roll(max(0.0, now - _SPAN), max(now, _SPAN))
        self.area.data_changed()
        self._report_output()

    def _report_output(self) -> None:
        monitor = next((s for s in self.signals if s.channel.name == "voltage_monitor"), None)
        if monitor is None or self._last_sample - self._last_report < _REPORT_EVERY:
            return
        self._last_report = self._last_sample
        volts = float(monitor.last().mean())
        tolerance = self._session.rig_file.limits.zero_tolerance_kV * 1e3
        known = Known.CONFIRMED if abs(volts) <= tolerance else Known.UNKNOWN
        self._session.output_read.emit(OutputState(known, time.time(), volts, tolerance=tolerance))

    @Slot()
    def _check_silence(self) -> None:
        """Show no number that is not of now."""
        silent = self._clock() - self._last_sample
        if self.reading and silent > _SILENT:
            for place in range(len(self.signals)):
                self._show_texts(place, "—", "—")
            self.message.show_text(f"No sample for {silent:.0f} s", "warn")

    # display

    def _show_values(self, place: int, value: float, noise: float) -> None:
        signal = self.signals[place]
        shown = signal.shown
        text = f"{number_text((value - shown.zero) * shown.factor, 4)} {shown.unit}".strip()
        if signal.at_end:
            text = f"▲ end of range, {text}"
        spread = f"{significant(noise * shown.noise_factor, 2)} {shown.noise_unit}".strip()
        self._show_texts(place, text, spread)

    def _show_texts(self, place: int, value: str, noise: str) -> None:
        for column, text in ((1, value), (2, noise)):
            item = self.table.item(place, column)
            if item is not None and item.text() != text:
                item.setText(text)

    def _clear(self) -> None:
        self._silence.stop()
        self.signals = []
        self.table.setRowCount(0)
        self._fit_table()
        self.plots.show_channels(())
        self.area.set_live(live=False)

    def _show_reading(self) -> None:
        reading = self.reading
        self.start_button.setText("St&op reading" if reading else "R&ead inputs")
        self.start_button.setEnabled(reading or not self._session.busy)
        self.reading_changed.emit(reading)

    @Slot()
    def _toggle(self) -> None:
        if self.reading:
            self.stop()
        else:
            self.start()

    def changeEvent(self, event: QEvent) -> None:  # noqa: N802
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange:
            self._fit_table()

    def _fit_table(self) -> None:
        header = self.table.horizontalHeader().sizeHint().height()
        rows = sum(self.table.rowHeight(row) for row in range(self.table.rowCount()))
        self.table.setFixedHeight(header + rows + 2 * self.table.frameWidth())

    def _build(self) -> None:
        self.start_button = button("R&ead inputs", "Read every input; nothing is output")
        self.start_button.clicked.connect(self._toggle)
        self.message = Message()
        self.message.show_text(_IDLE, "muted")
        self.table = QTableWidget(0, 3)
        self.table.setHorizontalHeaderLabels(("Channel", "Value", "Noise"))
        self.table.setAccessibleName("Live values of the inputs")
        self.table.verticalHeader().hide()
        self.table.setShowGrid(False)
        self.table.setEditTriggers(QTableWidget.EditTrigger.NoEditTriggers)
        self.table.setSelectionMode(QTableWidget.SelectionMode.NoSelection)
        self.table.setTabKeyNavigation(False)
        self.table.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.table.horizontalHeader().setSectionResizeMode(
            self.table.horizontalHeader().ResizeMode.Stretch
        )
        self._fit_table()
        self.area = PlotArea(self._session, "Live values", live=True)
        self.plots = ChannelPlots(self._session, self.area, 0)
        row = QHBoxLayout()
        row.addWidget(self.message, 1)
        row.addWidget(self.start_button, 0, Qt.AlignmentFlag.AlignTop)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, SPACE // 2, 0, 0)
        column.setSpacing(SPACE // 2)
        column.addLayout(row)
        column.addWidget(self.table)
        column.addWidget(self.area, 1)
