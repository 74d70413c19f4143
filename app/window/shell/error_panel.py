"""Panel with the errors of the program: not modal, above the pages."""

from __future__ import annotations

from PySide6.QtCore import Qt, QUrl, Slot
from PySide6.QtGui import QDesktopServices, QGuiApplication
from PySide6.QtWidgets import QFrame, QHBoxLayout, QVBoxLayout, QWidget

from dearig.log_file import log_path
from dearig.window.jobs.program_errors import ProgramErrors
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import button, label, plain_tip

__all__ = ["ErrorPanel"]

#: Errors whose sentences are shown; the details have all.
_SHOWN_MAX = 3


class ErrorPanel(QFrame):
    """Says which errors occurred in the program; hidden until there is one.

    Dismissed, it stays hidden until a different error occurs or ``show_errors`` is called.
    """

    def __init__(self, errors: ProgramErrors, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._errors = errors
        self._dismissed = 0  # number of different errors when it was dismissed
        self.setProperty("role", "card")
        self.setAccessibleName("Errors of the program")
        self.headline = label("", "bad")
        self.words = label("")
        self.words.setWordWrap(True)
        self.words.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.copy_button = button("&Copy details", "Copy versions and tracebacks for a report")
        self.copy_button.clicked.connect(self._copy)
        self.log_button = button("Open &log", "")
        self.log_button.clicked.connect(self._open_log)
        self.dismiss_button = button(
            "&Dismiss", "Hide this until a different error occurs; Window > Program errors shows it"
        )
        self.dismiss_button.clicked.connect(self._dismiss)
        for made in (self.copy_button, self.log_button, self.dismiss_button):
            # a key that stops a run must never press one of these
            made.setFocusPolicy(Qt.FocusPolicy.NoFocus)  # their letters with Alt press them
        text = QVBoxLayout()
        text.setSpacing(2)
        text.addWidget(self.headline)
        text.addWidget(self.words)
        row = QHBoxLayout(self)
        row.setContentsMargins(SPACE, SPACE // 2, SPACE, SPACE // 2)
        row.addLayout(text, 1)
        for made in (self.copy_button, self.log_button, self.dismiss_button):
            row.addWidget(made, 0, Qt.AlignmentFlag.AlignTop)
        errors.changed.connect(self._refresh)
        self.hide()
        self._refresh()

    @Slot()
    def show_errors(self) -> None:
        """Show the panel, also after it was dismissed; without errors it says so."""
        self._dismissed = 0
        self._refresh()
        self.show()

    @Slot()
    def _refresh(self) -> None:
        errors = self._errors.errors
        total = sum(error.count for error in errors)
        times = f", {total} times in all" if total > len(errors) else ""
        several = f"{len(errors)} different errors in the program{times}"
        one = f"Error in the program{f', {total} times' if total > 1 else ''}"
        self.headline.setText(
            several if len(errors) > 1 else one if errors else "No errors in the program"
        )
        last = sorted(errors, key=lambda error: error.last)[-_SHOWN_MAX:]
        lines = [
            f"{error.last:%H:%M:%S}  {error.sentence}"
            f"{f', {error.count} times' if error.count > 1 and len(errors) > 1 else ''}"
            for error in reversed(last)
        ]
        if errors:
            lines.append(
                "If a run is going on and you are in doubt, press STOP. If something in the window "
                "looks wrong, start the program again. Please report this with the details."
            )
        self.words.setText("\n".join(lines))
        self.copy_button.setEnabled(bool(errors))
        path = log_path()
        self.log_button.setEnabled(path.exists())
        there = str(path) if path.exists() else f"{path} is not there: it could not be written"
        self.log_button.setToolTip(plain_tip(there))
        if len(errors) > self._dismissed:
            self.show()

    @Slot()
    def _copy(self) -> None:
        QGuiApplication.clipboard().setText(self._errors.details)

    @Slot()
    def _open_log(self) -> None:
        QDesktopServices.openUrl(QUrl.fromLocalFile(str(log_path())))

    @Slot()
    def _dismiss(self) -> None:
        self._dismissed = len(self._errors.errors)
        self.hide()
