"""What the plots of the Run page show: the plan, or the last run behind a switch."""

from __future__ import annotations

from datetime import datetime

import numpy as np
from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QButtonGroup,
    QComboBox,
    QHBoxLayout,
    QMenu,
    QWidget,
)

from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import button, label, menu_button, set_role
from dearig.window.run.live_analysis import ANALYSES, LiveAnalysis
from dearig.window.run.plots import PLOTS, RunPlots
from dearig.window.session.settings import kept_text
from dearig.window.session.state import Preview, Session

__all__ = ["RunView", "planned_text"]

_SPANS = {"last 2 s": 2.0, "last 5 s": 5.0, "last 10 s": 10.0, "last 30 s": 30.0,
          "last 60 s": 60.0, "whole run": None}  # fmt: skip
_KEY = "run/plots"  # of the settings: names of the plots that are hidden
_NO_LAST = "There was no run since the window was opened"


def planned_text(preview: Preview | None) -> str:
    """Return what the plots show before a run: name, peak voltage and duration of the plan."""
    if preview is None:
        return "Planned: the plan is being made …"
    if preview.is_outline:
        return f"Preview, the model is being compiled: {preview.sentence}, {preview.duration:.1f} s"
    if preview.plan is None or preview.loaded is None:
        return "Planned: nothing, the sequence cannot be played"
    volts = preview.curves["voltage"][1]
    known = volts[np.isfinite(volts)]
    peak = float(known[np.argmax(np.abs(known))]) * 1e-3 if known.size else 0.0
    # + 0.0 turns a negative zero, which a small negative value is rounded to, into zero
    text = f"Planned: {preview.loaded.sequence.name}, peak {round(peak, 2) + 0.0:.2f} kV, "
    text += f"{preview.plan.duration:.1f} s"
    return text if preview.playable else f"{text} (refused by the limits)"


class RunView(QWidget):
    """Row above the plots: what they show, the switch, the time span, and the plots that are shown.

    ``changed``: the operator has chosen the plan or the last run; ``span_changed``: another span.
    """

    changed = Signal()
    span_changed = Signal()

    def __init__(
        self,
        session: Session,
        plots: RunPlots,
        analysis: LiveAnalysis,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._plots = plots
        self._analysis = analysis
        self._last = ""  # words on the last run
        self.words = label("", "heading")
        self.words.setAccessibleName("What the plots show")
        self.words.setWordWrap(True)  # names of sequences have any length
        self.planned = button("Planned", "Show the plan that will be played")
        self.last = button("Last run", _NO_LAST)
        self._choice = QButtonGroup(self)
        for made in (self.planned, self.last):
            made.setCheckable(True)
            made.setProperty("role", "switch")
            made.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # no stop key may press it
            self._choice.addButton(made)
        self.planned.setChecked(True)
        self.last.setEnabled(False)
        self._choice.buttonClicked.connect(self.changed)
        self.span = QComboBox()
        for words, seconds in _SPANS.items():
            self.span.addItem(f"Show {words}", seconds)
        self.span.setCurrentIndex(2)
        self.span.setToolTip("Time span of the plots of a run, in s")
        self.span.setAccessibleName("Time span of the plots")
        self.span.activated.connect(self.span_changed)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(SPACE // 2)
        row.addWidget(self.words, 1)
        for made in (self.planned, self.last):
            row.addWidget(made)
        row.addSpacing(SPACE)
        row.addWidget(self.span)
        row.addWidget(self._plots_menu())

    @property
    def shows_plan(self) -> bool:
        """True while the plots show the plan, False while they show a run."""
        return self.planned.isChecked()

    def show_planned(self, preview: Preview | None) -> None:
        """Show the plan."""
        self.planned.setChecked(True)
        self._set_words(planned_text(preview), "heading")
        if preview is not None and preview.plan is not None:
            tip = f"{preview.plan.samples:,} samples at {preview.plan.rate:g} Hz"
            self.words.setToolTip(f"{tip} on {self._session.address}")
        if preview is not None and not (preview.playable or preview.is_outline):
            set_role(self.words, "bad")

    def show_last(self) -> None:
        """Show the last run."""
        self.last.setChecked(True)
        self._set_words(self._last, "warn")

    def begin(self, name: str) -> None:
        """Show a run of the sequence ``name`` that begins."""
        self._last = f"Last run: {name}"
        self.last.setChecked(True)
        self._set_words(f"Running: {name}", "heading")
        for made in (self.planned, self.last):
            made.hide()

    def ending(self) -> None:
        """Say that the run is at its end, and goes on for its guardian or its file only."""
        self._set_words(self._last.replace("Last run", "Ending", 1), "warn")

    def end(self, headline: str, at: datetime | None = None) -> None:
        """Say how the run ended; the plots still show it."""
        moment = at or datetime.now().astimezone()
        self._last = f"{self._last}, {headline.lower()} at {moment:%H:%M:%S}"
        for made in (self.planned, self.last):
            made.show()
            made.setEnabled(True)
        self.last.setToolTip("Show the last run again")
        self.show_last()

    def _set_words(self, text: str, role: str) -> None:
        set_role(self.words, role)
        self.words.setText(text)

    def _plots_menu(self) -> QWidget:
        menu = QMenu(self)
        analysis = self._analysis
        hidden = kept_text(self._session.settings, _KEY).split(",")
        self.plot_actions: dict[str, QAction] = {}
        for name, words in PLOTS.items():
            action = menu.addAction(words)
            action.setCheckable(True)
            action.setChecked(name not in hidden)
            action.toggled.connect(lambda shown, name=name: self._show_plot(name, shown))
            self.plot_actions[name] = action
            self._plots.show_plot(name, name not in hidden)
        menu.addSeparator()
        for name, words in ANALYSES.items():
            action = menu.addAction(words)
            action.setCheckable(True)
            action.toggled.connect(lambda shown, name=name: analysis.show_view(name, shown))
            self.plot_actions[name] = action
        menu.addSeparator()
        self.trips_action = menu.addAction("Trip levels of the current in view")
        self.trips_action.setCheckable(True)
        self.trips_action.setChecked(True)
        self.trips_action.toggled.connect(self._show_trips)
        return menu_button("Plots", "Show or hide each plot", menu)

    def _show_plot(self, name: str, shown: bool) -> None:
        self._plots.show_plot(name, shown)
        there = self._plots.shown
        self.plot_actions[name].setChecked(name in there)  # the last one stays
        hidden = [other for other in PLOTS if other not in there]
        self._session.settings.setValue(_KEY, ",".join(hidden))
        self.span_changed.emit()

    @Slot(bool)
    def _show_trips(self, shown: bool) -> None:
        self._plots.trips_in_view = shown
        self._plots.rescale()
