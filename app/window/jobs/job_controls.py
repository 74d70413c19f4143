"""Parts that pages are made of: splitters, the side with the results, and the progress of a job."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from PySide6.QtCore import Qt, Slot
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QBoxLayout,
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

_PARTS = 1000  # of the bar of progress
_HEADLINE = 300  # px that a headline has next to its buttons, at least


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
    side = QWidget()
    outer = QVBoxLayout(side)
    outer.setContentsMargins(SPACE, 0, 0, 0)
    outer.addWidget(_Head(headline, buttons))
    for message in messages:
        outer.addWidget(message)
    outer.addWidget(results, 1)
    for part in below:
        outer.addWidget(part)
    return side


class _Head(QWidget):
    """Headline, and next to it buttons, or below it where they would leave it too little width."""

    def __init__(self, headline: QLabel, buttons: Sequence[QPushButton]) -> None:
        super().__init__()
        headline.setWordWrap(True)
        self._both = QBoxLayout(QBoxLayout.Direction.LeftToRight, self)
        self._both.setContentsMargins(0, 0, 0, 0)
        self._both.addWidget(headline, 1)
        self._tools = QHBoxLayout()
        for made in buttons:
            self._tools.addWidget(made, 0, Qt.AlignmentFlag.AlignTop)
        self._both.addLayout(self._tools)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        super().resizeEvent(event)
        is_narrow = self.width() < self._tools.sizeHint().width() + _HEADLINE
        direction = QBoxLayout.Direction
        self._both.setDirection(direction.TopToBottom if is_narrow else direction.LeftToRight)


class JobControls(QWidget):
    """Button ``start`` of a job, one that cancels it, its progress and the time that is left.

    ``cancel`` is the text of the latter, with its key, and ``tip`` its tooltip. With ``cancelled``
    that button can always be pressed, and calls it in place of ``cancel``.
    """

    def __init__(
        self,
        start: QPushButton,
        cancel: str,
        tip: str = "End the computation; a second click ends at once",
        cancelled: Callable[[], object] | None = None,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.job: Job | None = None
        self._always = cancelled is not None
        self.cancel_button = button(cancel, tip)
        self.cancel_button.clicked.connect(cancelled or self.cancel)
        self.bar = QProgressBar()
        self.bar.setTextVisible(False)
        self.bar.setFixedHeight(8)
        self.stage = label("", "muted")
        self.stage.setWordWrap(True)
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
        self.job = job
        job.progressed.connect(self._progressed)
        self.stage.setText("Starting")
        self.bar.setRange(0, 0)
        self.cancel_button.setEnabled(True)

    def end(self) -> None:
        """Show that no job goes on."""
        self.job = None
        self.stage.setText(" ")  # keeps its height
        self.bar.setRange(0, 1)
        self.bar.reset()
        self.cancel_button.setEnabled(self._always)

    @Slot()
    def cancel(self) -> None:
        """End the job; the second call ends it at once."""
        if self.job is not None:
            self.stage.setText("Ending; click Cancel again to end at once")
            self.job.cancel()

    @Slot(str, float, float)
    def _progressed(self, stage: str, fraction: float, left: float) -> None:
        if self.job is None or self.job.asked_to_stop:
            return
        if fraction > 0.0:  # a stage that reports no fraction keeps the bar that only moves
            self.bar.setRange(0, _PARTS)
            self.bar.setValue(round(_PARTS * fraction))
        of = "" if self.job.whole else " of this step"
        about = "" if math.isnan(left) else f", about {_roughly(left)}{of} left"
        self.stage.setText(f"{stage[:1].upper()}{stage[1:]}{about}")


def _roughly(left: float) -> str:
    """Return a rough duration; ``left`` in s."""
    return f"{max(round(left), 1)} s" if left < 100.0 else f"{round(left / 60.0)} min"
