"""Hold of a displacement on the page Follow: plan it, watch its feedback, and see its error."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import Qt, QTimer, Signal, Slot
from PySide6.QtWidgets import (
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QVBoxLayout,
    QWidget,
)

from dearig.analysis.hold import HoldOptions, HoldOutcome
from dearig.report.pages.hold import hold_summary
from dearig.report.pages.track import limits_table
from dearig.report.text.numbers import seconds, significant
from dearig.report.text.tables import Table
from dearig.window.follow.hold_jobs import (
    HoldForecast,
    HoldRequest,
    forecast_hold,
    measure_hold,
    write_hold_report,
)
from dearig.window.follow.model_choice import ModelChoice
from dearig.window.jobs.job_controls import JobControls, result_side, splitter
from dearig.window.jobs.worker import Job, Worker
from dearig.window.kit.browser import open_in_browser
from dearig.window.kit.number_box import NumberBox
from dearig.window.kit.report_page import ReportPage
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import Message, button, card, label
from dearig.window.plots.area import PlotArea
from dearig.window.run.hold_texts import answer_text
from dearig.window.run.live import Live
from dearig.window.run.runner import Play, RunEnd
from dearig.window.session.layout_state import remember
from dearig.window.session.state import Session

__all__ = ["HoldPanel"]

_LEFT = 330  # px, default width of the left column
_DRAW = 500  # ms between two drawings of a run: there are ten answers a second
_UNITS = (("s", 1.0), ("min", 60.0), ("h", 3600.0))
_UM = "\N{MICRO SIGN}m"
#: Field of ``HoldOptions``: label, lowest and highest value, decimals, unit, its factor, tooltip.
_OPTIONS = (
    ("rise", "&Rise", 0.5, 600.0, 1, " s", 1.0, "Time of the rise, and of the fall"),
    ("authority", "&Authority", 0.1, 50.0, 1, " %", 0.01,
     "Largest correction either way, as a part of the voltage; the gate enforces it"),
    ("rate_limit", "Ra&te", 0.01, 100.0, 2, " %/s", 0.01,
     "Largest change of the correction; the gate enforces it"),
    ("response", "Re&sponse", 0.2, 3600.0, 1, " s", 1.0,
     "Response time of the loop, besides its delay"),
    ("laser_loss", "&Laser loss", 0.2, 600.0, 1, " s", 1.0,
     "Time without usable readings, after which the voltage is ramped down"),
)  # fmt: skip


class HoldPanel(QWidget):
    """Plans a hold, which is armed on the page Run, and shows its feedback while it runs.

    ``play_hold`` carries a ``HoldPlan`` for the page Run; ``use_model`` the model file to overlay
    there; ``waits`` is True while its run is awaited.
    """

    play_hold = Signal(object)
    use_model = Signal(Path)
    waits = Signal(bool)

    def __init__(self, session: Session, worker: Worker, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.worker = worker
        self._job: Job | None = None
        self._forecast: HoldForecast | None = None
        self._outcome: HoldOutcome | None = None
        self._live: Live | None = None  # of a run of the forecast
        self._running = False
        self.split = splitter(
            Qt.Orientation.Horizontal, self._make_inputs(), self._make_results(), growing=1
        )
        self.reset_layout()
        remember(self.split, session.settings, "hold/columns")
        remember(self.rows, session.settings, "hold/rows")
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, SPACE, 0, 0)
        outer.addWidget(self.split)
        self._drawing = QTimer(self, interval=_DRAW)
        self._drawing.timeout.connect(self._draw_run)
        self.model.changed.connect(self._refresh)
        session.rig_changed.connect(self._refresh)
        session.notes_changed.connect(self._refresh)
        session.running_changed.connect(self._refresh)
        session.theme_changed.connect(self._draw)
        self._refresh()

    # what the panel offers

    @property
    def forecast(self) -> HoldForecast | None:
        """The hold that is shown."""
        return self._forecast

    @property
    def outcome(self) -> HoldOutcome | None:
        """The errors of its last run, None before it."""
        return self._outcome

    def request(self) -> HoldRequest:
        """Return what the inputs ask for."""
        session = self._session
        options = {name: self.options[name].value() * factor for name, *_, factor, _ in _OPTIONS}
        return HoldRequest(
            self.displacement.value() * 1e-3,
            self.duration.value() * float(self.unit.currentData()),
            HoldOptions(**options),
            self.model.path,
            session.address,
            session.rig_file,
            session.film,
        )

    @Slot()
    def check(self) -> None:
        """Say whether the displacement can be held; nothing is played."""
        if self._job is None:
            self._submit(self.worker.submit(forecast_hold, self.request()), self._planned)

    @Slot()
    def show_on_run(self) -> None:
        """Show the hold on the page Run, to arm and start it there."""
        forecast = self._forecast
        if forecast is None:
            return
        if forecast.request.model is not None:
            self.use_model.emit(forecast.request.model)
        self.play_hold.emit(forecast.plan)
        self.waits.emit(True)

    @Slot(object)
    def watch(self, live: Live) -> None:
        """Show the feedback of the run of ``live``, where it is that of this hold."""
        forecast = self._forecast
        if forecast is None or self._session.hold is not forecast.plan:
            return
        self._live, self._running, self._outcome = live, True, None
        self.message.show_text("")
        self._draw()
        self.area.auto_range()
        self._drawing.start()

    @Slot(object)
    def run_ended(self, end: RunEnd) -> None:
        """Measure the error of a run of this hold."""
        if not self._running or end.play is not Play.RUN:
            return
        self._running = False
        self._drawing.stop()
        self._draw_run()
        self.waits.emit(False)
        if end.result is None:
            self.message.show_text(f"{end.headline}: {end.sentence}", "warn")
        answers = np.empty((0, 3)) if self._live is None else self._live.answers()
        until = float(answers[-1, 0]) if answers.size else 0.0
        if end.path is not None and self._forecast is not None and self._job is None:
            job = self.worker.submit(measure_hold, self._forecast, end.path, end.result, until)
            self._submit(job, self._measured, keep_message=end.result is None)

    @Slot()
    def open_report(self) -> None:
        """Write the report next to the recording, and open it in the browser."""
        if self._outcome is not None and self._job is None:
            self._submit(self.worker.submit(write_hold_report, self._outcome), self._report_written)

    @Slot()
    def reset_layout(self) -> None:
        """Give every part its default size."""
        self.split.setSizes([_LEFT, 860])
        self.rows.setSizes([420, 230])

    def close_work(self) -> None:
        """Stop drawing, and wait for the threads."""
        self._drawing.stop()
        self._job = self._live = None
        self.model.close_work()

    # jobs

    def _submit(self, job: Job, done: Callable[[Any], None], keep_message: bool = False) -> None:
        self._job = job
        if not keep_message:
            self.message.show_text("")
        job.finished.connect(done)
        job.finished.connect(self._job_ended)
        job.failed.connect(self._failed)
        job.cancelled.connect(self._job_ended)
        self.job.begin(job)
        self._refresh()

    @Slot()
    def _job_ended(self) -> None:
        self._job = None
        self.job.end()
        self._refresh()

    @Slot(str)
    def _failed(self, sentence: str) -> None:
        self._job_ended()
        before = self.message.text()
        text = f"{sentence[:1].upper()}{sentence[1:]}."
        self.message.show_text(f"{before}\n{text}" if before else text)

    @Slot(object)
    def _planned(self, forecast: HoldForecast) -> None:
        self._forecast, self._outcome, self._live = forecast, None, None
        numbers, feedback = forecast.numbers, forecast.plan.feedback
        self.headline.setText(
            f"{numbers['setpoint_mm']:.4g} mm can be held for {seconds(forecast.request.duration)}"
        )
        pieces: list[str | Table] = [
            f"The model's voltage is {significant(numbers['voltage_kV'])} kV, and up to "
            f"{significant(numbers['highest_kV'])} kV with the whole authority.",
            f"Each answer is output {numbers['delay_s']:.3g} s after its readings. By the "
            f"model, the loop has a gain margin of {significant(numbers['gain_margin'], 2)} and a "
            f"phase margin of {significant(numbers['phase_margin_deg'], 2)} degrees.",
            f"Without usable readings for {feedback.laser_loss:.3g} s the voltage is ramped down.",
            "Click Show on Run, look at its plan there, then Arm and Start. This page shows error "
            "and correction while it runs; STOP ends it as any other.",
            limits_table(forecast.margins),
        ]
        self.words.show_pieces(pieces, tuple(f"{w}." for w in forecast.warnings))
        self._draw()
        self.area.auto_range()

    @Slot(object)
    def _measured(self, outcome: HoldOutcome) -> None:
        self._outcome = outcome
        rms, noise = significant(outcome.settled_rms * 1e6), significant(outcome.noise * 1e6)
        self.headline.setText(
            f"{outcome.setpoint * 1e3:.4g} mm: error {rms} {_UM} RMS after "
            f"{significant(outcome.settled)} s, noise {noise} {_UM}"
        )
        summary: list[str | Table] = list(hold_summary(outcome))
        self.words.show_pieces([*summary, f"Recording: {outcome.recording}"])
        self.state.show_text("")
        self._draw()

    @Slot(object)
    def _report_written(self, path: Path) -> None:
        open_in_browser(path, self.message)

    # display

    @Slot()
    def _draw_run(self) -> None:
        if self._live is None:
            return
        answer = self._live.last_answer
        if answer is not None:
            self.state.show_text(*answer_text(answer))
        self._draw()

    @Slot()
    def _draw(self) -> None:
        """Draw the planned voltage, and what the feedback has done so far."""
        forecast, theme, live = self._forecast, self._session.theme, self._live
        for plot in self.plots:
            plot.clear_all()
        if forecast is None:
            return
        voltage, error, correction = self.plots
        voltage.add_curve("planned", theme.command).set_points(
            forecast.time, forecast.voltage * 1e-3
        )
        authority = forecast.plan.feedback.authority * 100.0
        correction.add_levels(theme, "Largest correction", -authority, authority)
        if self._outcome is not None and math.isfinite(self._outcome.noise):
            noise = self._outcome.noise * 1e6
            error.add_levels(theme, "Noise of a reading", -noise, noise)
        if live is None:
            return
        time, errors, corrections = live.answers().T
        error.add_curve("setpoint - reading, means of 0.1 s", theme.measured).set_points(
            time, errors * 1e6
        )
        correction.add_curve("correction", theme.models[0]).set_points(time, corrections * 100.0)
        read_at, volts = live.view("monitor", 0.0, float(forecast.time[-1]))
        voltage.add_curve("measured", theme.monitor).set_points(read_at, volts * 1e-3)

    @Slot()
    def _refresh(self) -> None:
        forecast, session = self._forecast, self._session
        free = self._job is None and not session.running
        changed = forecast is not None and forecast.request != self.request()
        if changed and not self._running:
            self.state.show_text("The hold or the rig has changed: check it again.", "warn")
        elif not self._running and self._live is None:
            self.state.show_text("")
        self.check_button.setEnabled(free)
        self.run_button.setEnabled(free and forecast is not None and not changed)
        self.report_button.setEnabled(self._job is None and self._outcome is not None)

    # layout

    def _make_inputs(self) -> QWidget:
        self.displacement = NumberBox(0.001, 1000.0, 0.5, decimals=3, unit=" mm")
        self.displacement.setSingleStep(0.05)
        self.displacement.setToolTip("Displacement from the loaded rest state")
        self.duration = NumberBox(0.01, 1e6, 60.0, decimals=2)
        self.duration.setToolTip("Time for which it is held, without rise and fall")
        self.unit = QComboBox()
        for name, factor in _UNITS:
            self.unit.addItem(name, factor)
        self.unit.setAccessibleName("Unit of the duration")
        lasting = QHBoxLayout()
        lasting.addWidget(self.duration, 1)
        lasting.addWidget(self.unit)
        self.model = ModelChoice(self._session)
        form = QFormLayout()
        form.addRow("&Displacement", self.displacement)
        caption = label("Durat&ion")
        caption.setBuddy(self.duration)
        form.addRow(caption, lasting)
        form.addRow("&Model", self.model)
        self.options: dict[str, NumberBox] = {}
        for name, words, low, high, decimals, unit, factor, tip in _OPTIONS:
            value = getattr(HoldOptions(), name) / factor
            field = NumberBox(low, high, value, decimals=decimals, unit=unit)
            field.setToolTip(tip)
            field.valueChanged.connect(self._refresh)
            form.addRow(words, field)
            self.options[name] = field
        self.displacement.valueChanged.connect(self._refresh)
        self.duration.valueChanged.connect(self._refresh)
        self.unit.currentIndexChanged.connect(self._refresh)
        self.check_button = button(
            "&Check the hold", "Say whether it can be held; nothing is played", True
        )
        self.check_button.clicked.connect(self.check)
        self.job = JobControls(self.check_button, "Ca&ncel")
        inner = QVBoxLayout()
        inner.addLayout(form)
        inner.addWidget(self.job)
        inner.addStretch(1)
        frame = card(inner)
        frame.setMinimumWidth(280)
        return frame

    def _make_results(self) -> QWidget:
        self.headline = label("No hold yet", "title")
        self.run_button = button(
            "Show &on Run", "Show the hold on the page Run, to arm and start it there", True
        )
        self.run_button.clicked.connect(self.show_on_run)
        self.report_button = button(
            "Open re&port", "Write the report next to the recording and open it in the browser"
        )
        self.report_button.clicked.connect(self.open_report)
        self.state = Message()
        self.message = Message()
        self.area = PlotArea(self._session, "Hold")
        self.plots = [
            self.area.add_plot(row, left=words, weight=weight)
            for row, (words, weight) in enumerate(
                (("Voltage (kV)", 3), (f"Error ({_UM})", 4), ("Correction (%)", 3))
            )
        ]
        self.words = ReportPage()
        self.words.show_pieces(_INTRODUCTION)
        self.rows = splitter(Qt.Orientation.Vertical, self.area, self.words, growing=0)
        return result_side(
            self.headline, (self.report_button, self.run_button), (self.state, self.message),
            self.rows,
        )  # fmt: skip


#: Text of the panel before the first check.
_INTRODUCTION = (
    "The model's voltage brings the film to a displacement. While it is played, the reading of the "
    "laser corrects it against creep, within an authority and a rate that the gate enforces.",
    "Check the hold says whether the film can reach it, the margins to all limits, and the delay "
    "of the feedback, before anything is played.",
)
