"""Parts that pages are made of: splitters, the side with the results, and the progress of a job."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt, Slot
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from dearig.window.jobs.worker import Job
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import button, label

__all__ = ["JobControls", "result_side", "splitter"]


def splitter(orientation: Qt.Orientation, *parts: QWidget, growing: int | None = None) -> QSplitter:
    """Make a splitter of ``parts``, which cannot be collapsed; the one ``growing`` takes space."""
    made = QSplitter(orientation)
    for part in parts:
        made.addWidget(part)
    if growing is not None:
        made.setStretchFactor(growing, 1)
    made.setChildrenCollapsible(False)
    return made


def result_side(
    headline: QLabel,
    buttons: Sequence[QPushButton],
    messages: Sequence[QWidget],
    results: QWidget,
    *below: QWidget,
) -> QWidget:
    """Make the right side of a page: headline and buttons, messages, results, what is below."""
    headline.setWordWrap(True)
    top = QHBoxLayout()
    top.addWidget(headline, 1)
    for made in buttons:
        top.addWidget(made, 0, Qt.AlignmentFlag.AlignTop)
    side = QWidget()
    outer = QVBoxLayout(side)
    outer.setContentsMargins(SPACE, 0, 0, 0)
    outer.addLayout(top)
    for message in messages:
        outer.addWidget(message)
    outer.addWidget(results, 1)
    for part in below:
        outer.addWidget(part)
    return side


class JobControls(QWidget):
    """Button ``start`` of a job, one that cancels it, and its progress.

    ``cancel`` is the text of the latter, with its key.
    """

    def __init__(self, start: QPushButton, cancel: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._job: Job | None = None
        self.cancel_button = button(cancel, "End the computation; a second click ends at once")
        self.cancel_button.clicked.connect(self._cancel)
        self.bar = QProgressBar()
        self.bar.setTextVisible(False)
        self.bar.setFixedHeight(8)
        self.stage = label("", "muted")
        buttons = QHBoxLayout()
        buttons.addWidget(start, 2)
        buttons.addWidget(self.cancel_button, 1)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(buttons)
        column.addWidget(self.bar)
        column.addWidget(self.stage)
        self.end()

    def begin(self, job: Job) -> None:
        """Show the progress of ``job``."""
        self._job = job
        job.progressed.connect(self._progressed)
        self.stage.setText("Starting")
        self.bar.setRange(0, 0)
        self.cancel_button.setEnabled(True)

    def end(self) -> None:
        """Show that no job goes on."""
        self._job = None
        self.stage.setText(" ")  # keeps its height
        self.bar.setRange(0, 1)
        self.cancel_button.setEnabled(False)

    @Slot(str, float, float)
    def _progressed(self, stage: str, fraction: float, left: float) -> None:  # noqa: ARG002
        if self._job is not None and not self._job.asked_to_stop:
            self.stage.setText(f"{stage[:1].upper()}{stage[1:]}")

    @Slot()
    def _cancel(self) -> None:
        if self._job is not None:
            self.stage.setText("Ending; click Cancel again to end at once")
            self._job.cancel()
