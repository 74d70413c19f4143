"""Right side of the Run page: the plan or a run in plots, marks, and alarms."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import Qt, QTimer, Slot
from PySide6.QtWidgets import QHBoxLayout, QSplitter, QVBoxLayout, QWidget

from dearig.acquisition.marks import RunMarks
from dearig.drivers.settings import ChannelSettings
from dearig.recording.reading.marks import read_mark
from dearig.window.high_voltage.alarms import AcknowledgeBar, Alarm, AlarmLog, AlarmTable
from dearig.window.kit.theme import SPACE
from dearig.window.run.channel_plots import ChannelPlots
from dearig.window.run.live import Live, LiveEvent
from dearig.window.run.live_analysis import LiveAnalysis
from dearig.window.run.marks import MarkBar
from dearig.window.run.pace import ShownTime
from dearig.window.run.plots import RunPlots
from dearig.window.run.view import RunView
from dearig.window.session.layout_state import remember
from dearig.window.session.state import Preview, Session

__all__ = ["RunDisplay"]

_FRAME = 16  # ms between two frames of the plots
_ANALYSIS = 500  # ms between two loops or spectra of the newest samples
_NOTHING: tuple[object, ...] = ()


class RunDisplay(QWidget):
    """Shows a plan, a run in progress, or the last run.

    While no run is in progress it shows the plan that Start would play: every new plan replaces
    what is drawn, and so does arming. The last run is shown when the operator asks for it, and
    after its end until then.
    """

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
        self._pace = ShownTime()
        self._live: Live | None = None
        self._running = False
        self._marks: list[tuple[str, float, str, str]] = []  # of the run: key, time, words, level
        self._errors = 0  # of the program, that are in the list
        self._drawn = _NOTHING  # what the last frame was made of
        self._channels: tuple[ChannelSettings, ...] = ()  # that are drawn
        self._run_channels: tuple[ChannelSettings, ...] = ()
        self.plots = RunPlots(session)
        self.analysis = LiveAnalysis(session)
        self.channel_plots = ChannelPlots(session, self.plots.area, self.plots.rows)
        self.view = RunView(session, self.plots, self.analysis)
        self.alarms = AlarmLog(self)
        self.table = AlarmTable(self.alarms, session)
        self.acknowledge = AcknowledgeBar(self.alarms, session)
        self.mark_bar = MarkBar()
        self._frames = QTimer(self, interval=_FRAME, timerType=Qt.TimerType.PreciseTimer)
        self._frames.timeout.connect(self.draw)
        self._analyses = QTimer(self, interval=_ANALYSIS)
        self._analyses.timeout.connect(self._analyse)
        self._build()
        self.view.changed.connect(self._chosen)
        self.view.span_changed.connect(self._span_changed)
        self.plots.view_changed.connect(self._view_changed)
        self.mark_bar.said.connect(session.message)
        self.alarms.acknowledged.connect(self._acknowledged)
        session.program_errors.changed.connect(self._program_errors)
        self._span_changed()
        self.show_planned()

    # before a run

    @property
    def digest(self) -> str:
        """Digest of the waveform whose plan is drawn; "" where none is that may be played."""
        return self.plots.digest

    def show_planned(self) -> None:
        """Show the plan of the session; during a run nothing changes."""
        if self._running:
            return
        preview = self._session.preview or self._session.outline
        self._stop_drawing()
        self.view.show_planned(preview)
        self.plots.show_prediction(preview)
        self._show_channels(self._session.rig_file.channel)

    # a run

    def begin(self, live: Live, preview: Preview | None, name: str, marks: RunMarks | None) -> None:
        """Show the run of ``live`` from its start; without ``marks``, none can be set in it."""
        self._live, self._running, self._drawn = live, True, _NOTHING
        self._pace = ShownTime()
        self._marks.clear()
        self._run_channels = self._session.rig_file.channel
        self.view.begin(name)
        self.plots.show_prediction(preview)
        self.plots.start()
        self._show_channels(self._session.rig_file.channel)
        self.mark_bar.follow(marks)
        self.alarms.add("info", f"{name}: run started", 0.0)
        self._start_drawing()

    def end(self, headline: str, sentence: str, level: str) -> None:
        """Show how the run ended, and its curves until the plan changes."""
        self.take_events()
        now = None if self._live is None else self._live.now()
        seconds = None if now is None else now.samples / now.rate
        self.alarms.add(level, f"{headline}: {sentence}", seconds)
        self._running = False
        self.mark_bar.follow(None)
        self.view.end(headline)
        self.draw()  # all of it: what flowed one block behind the run is at its end now

    def forget_run(self) -> None:
        """Stop drawing: the curves of the run are about to be closed."""
        self._stop_drawing()
        self._live = None

    def redraw(self) -> None:
        """Draw the next frame even if no sample has come."""
        self._drawn = _NOTHING

    def take_events(self) -> None:
        """Put the events since the last call into the list, and draw those that are marked."""
        live = self._live
        now = None if live is None else live.now()
        if live is None or now is None:
            return
        for happened in live.take_events():
            self._take(happened, happened.event.sample / now.rate)

    def _take(self, happened: LiveEvent, seconds: float) -> None:
        event = happened.event
        mark = read_mark(event.message) if event.level == "info" else None
        if mark is not None:
            number, note = mark
            self._mark(f"mark {number}", seconds, note or f"mark {number}", "info")
        elif event.level != "info":
            key = f"alarm {event.sample} {event.message}"
            self._mark(key, seconds, event.level, event.level)
        # the operator knows that he has pressed STOP
        known = event.message.startswith("interrupted by the operator")
        self.alarms.add(event.level, event.message, seconds, happened.at, "STOP" if known else "")

    def _mark(self, key: str, time: float, words: str, level: str) -> None:
        self._marks.append((key, time, words, level))
        if not self.view.shows_plan:
            self.plots.add_mark(key, time, words, level)

    @Slot()
    def _program_errors(self) -> None:
        """Put errors of the program into the list, each kind once."""
        for error in self._session.program_errors.errors[self._errors :]:
            self.alarms.add("fault", f"error of the program: {error.sentence}", at=error.first)
            self._errors += 1

    @Slot(object, str)
    def _acknowledged(self, alarms: tuple[Alarm, ...], who: str) -> None:
        """Record the acknowledgement in the run in progress."""
        marks = self.mark_bar.marks
        if marks is not None:
            count = f"{len(alarms)} alarms" if len(alarms) > 1 else "1 alarm"
            marks.remark(f"{count} acknowledged by {who[:80]}")

    @Slot()
    def draw(self) -> None:
        """Draw a frame, if there is something new."""
        live = self._live
        now = None if live is None else live.now()
        if live is None or now is None or self.view.shows_plan or not self.isVisible():
            return
        end = now.samples / now.rate
        shown = self._pace.shown(end, self._clock()) if self._running else end
        following = self.plots.following
        at = None if following else self.plots.x_range()
        # while the axis stands, curves grow from frame to frame; later it moves below them
        step = self.plots.step_of(shown) if following else 0
        frame = (now.revision, self.plots.span_s, at, step, self._running)
        if frame == self._drawn:
            self.plots.flow(shown)
            return
        self._drawn = frame
        self.plots.draw(live, end, shown)
        names = [channel.name for channel in self._channels]
        first, last = self.plots.x_range()
        if following:
            last = self.plots.last_drawn(end, shown)
        self.channel_plots.draw(live, names, first, last)

    def _start_drawing(self) -> None:
        self._frames.start()
        self._analyses.start()

    def _stop_drawing(self) -> None:
        self._frames.stop()
        self._analyses.stop()
        self.analysis.clear()

    @Slot()
    def _analyse(self) -> None:
        if self._live is not None and self.isVisible():
            self.analysis.draw(self._live, self.plots.span_s)

    # what the operator chooses

    @Slot()
    def _chosen(self) -> None:
        if self.view.shows_plan:
            self.show_planned()
        elif self._live is not None:
            self.view.show_last()
            self.plots.start()
            for mark in self._marks:
                self.plots.add_mark(*mark)
            self._show_channels(self._run_channels)
            self.redraw()
            self._start_drawing()

    @Slot()
    def _span_changed(self) -> None:
        self.plots.span_s = self.view.span.currentData()
        if not self.view.shows_plan:
            self.plots.area.follow()  # draws again

    @Slot()
    def _view_changed(self) -> None:
        self.redraw()
        self.draw()

    def _show_channels(self, channels: tuple[ChannelSettings, ...]) -> None:
        self._channels = channels
        self.channel_plots.show_channels(
            [(c.shown, c.unit) for c in channels],
            limits=[(c.limit_min, c.limit_max) for c in channels],
        )

    # layout

    def _build(self) -> None:
        above = QVBoxLayout()
        above.setContentsMargins(0, 0, 0, 0)
        above.setSpacing(SPACE // 2)
        above.addWidget(self.view)
        halves = QSplitter(Qt.Orientation.Horizontal)
        halves.setChildrenCollapsible(False)
        halves.addWidget(self.plots)
        halves.addWidget(self.analysis)
        halves.setStretchFactor(0, 1)
        above.addWidget(halves, 1)
        upper = QWidget()
        upper.setLayout(above)
        row = QHBoxLayout()
        row.setSpacing(SPACE)
        row.addWidget(self.mark_bar, 1)
        row.addWidget(self.acknowledge)
        below = QVBoxLayout()
        below.setContentsMargins(0, 0, 0, 0)
        below.setSpacing(SPACE // 2)
        below.addLayout(row)
        below.addWidget(self.table, 1)
        lower = QWidget()
        lower.setLayout(below)
        self.split = QSplitter(Qt.Orientation.Vertical)
        self.split.addWidget(upper)
        self.split.addWidget(lower)
        self.split.setStretchFactor(0, 1)
        self.split.setStretchFactor(1, 0)
        self.split.setChildrenCollapsible(False)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.split)
        remember(self.split, self._session.settings, "run")
