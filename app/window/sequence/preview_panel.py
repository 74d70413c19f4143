"""Preview of a sequence: predicted curves, the verdict of the gate, and the margins to limits."""

from __future__ import annotations

from PySide6.QtCore import QTimer, Slot
from PySide6.QtWidgets import QGridLayout, QLabel, QProgressBar, QVBoxLayout, QWidget

from dearig.drivers.gate import Margin
from dearig.window.kit.fields import as_labelled
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import Message, card, label
from dearig.window.sequence.preview_plots import PreviewPlots
from dearig.window.session.state import Preview, Session

__all__ = ["PreviewPanel"]

#: What is said of curves that are drawn before the model is compiled.
OUTLINE = "Preview: the limits are judged, and it can be armed, once the model is compiled"
_MARGINS_MAX = 6
_FAULTS_MAX = 6  # more do not fit below the plots of a small screen; the table marks all
#: Time in ms for which the last plan stays drawn, so that the plots do not flicker while one types.
_CLEAR_AFTER = 300


class PreviewPanel(QWidget):
    """Shows the plan of a sequence while it is edited."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.plots = PreviewPlots(session)
        self.state = Message()
        self.margins: list[tuple[QLabel, QProgressBar]] = []
        self._clear = QTimer(self, singleShot=True, interval=_CLEAR_AFTER)
        self._clear.timeout.connect(self._clear_plots)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.plots, 1)
        below = QVBoxLayout()
        below.setSpacing(4)
        below.addWidget(self.state)
        below.addLayout(self._margin_bars())
        column.addWidget(card(below))

    def show_planning(self) -> None:
        """Say that a plan is being made; the curves of the last one are removed after a while."""
        self.state.show_text("Planning …", "muted")
        self._clear.start()

    @Slot(float)
    def show_progress(self, part: float) -> None:
        """Say how much of a plan is made, once it takes so long that the last one is removed."""
        if not self._clear.isActive():
            self.state.show_text(f"Planning … {part:.0%}", "muted")

    def show_outline(self, outline: Preview) -> None:
        """Show the curves of a plan that is not judged yet."""
        self._clear.stop()
        self.plots.show_preview(outline)
        self.state.show_text(OUTLINE, "muted")

    def show_preview(self, preview: Preview) -> None:
        """Show a plan, or why there is none."""
        self._clear.stop()
        self.plots.show_preview(preview)
        if preview.playable and preview.plan is not None:
            seconds, samples = preview.plan.duration, preview.plan.samples
            self.state.show_text(
                f"✓ Within all limits: {seconds:.2f} s, {samples:,} samples", "good"
            )
        elif preview.plan is not None:
            rows = [fault.sentence for fault in preview.faults if fault.key is None]
            self._show_faults(
                "Refused by the limits of the rig file:", [*preview.plan.reasons, *rows]
            )
        else:
            self._show_faults("", [fault.sentence for fault in preview.faults])
        waveform = None if preview.plan is None else preview.plan.waveform
        self._show_margins(() if waveform is None else waveform.margins)

    def _show_faults(self, head: str, sentences: list[str]) -> None:
        lines = [f"✗ {as_labelled(sentence)}" for sentence in sentences[:_FAULTS_MAX]]
        if len(sentences) > _FAULTS_MAX:
            lines.append(f"and {len(sentences) - _FAULTS_MAX} more, marked in the table")
        self.state.show_text("\n".join(filter(None, [head, *lines])), "bad")

    @Slot()
    def _clear_plots(self) -> None:
        self.plots.show_preview(None)

    def _show_margins(self, margins: tuple[Margin, ...]) -> None:
        for row, (words, bar) in enumerate(self.margins):
            there = row < len(margins)
            words.setVisible(there)
            bar.setVisible(there)
            if there:
                margin = margins[row]
                words.setText(
                    f"{margin.quantity}: {margin.reached:.4g} of {margin.allowed:.4g} {margin.unit}"
                )
                share = margin.reached / margin.allowed if margin.allowed > 0.0 else 0.0
                bar.setValue(round(100 * min(max(share, 0.0), 1.0)))

    def _margin_bars(self) -> QGridLayout:
        grid = QGridLayout()
        grid.setHorizontalSpacing(2 * SPACE)
        for i in range(_MARGINS_MAX):
            words, bar = label(""), QProgressBar()
            bar.setTextVisible(False)
            bar.setFixedHeight(6)
            bar.setToolTip("Share of the limit that is used")
            grid.addWidget(words, 2 * (i // 2), i % 2)
            grid.addWidget(bar, 2 * (i // 2) + 1, i % 2)
            words.hide()
            bar.hide()
            self.margins.append((words, bar))
        return grid
