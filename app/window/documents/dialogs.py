"""Dialogs of the window; none of them takes STOP away while the rig is armed or a run goes on.

A modal dialog blocks clicks on the main window. While the rig is armed or a run goes on, dialogs
are therefore not modal, lie below the bar with STOP, and are drawn by Qt: the file dialogs of some
systems block their program. At other times they are modal, and nothing can be armed while one is
open. All dialogs of the window are shown by this module.
"""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QEventLoop, QPoint, Qt
from PySide6.QtWidgets import QDialog, QFileDialog, QInputDialog, QMessageBox, QWidget

from dearig.window.session.state import Session

__all__ = [
    "ask",
    "ask_text",
    "choose_file",
    "choose_files",
    "choose_folder",
    "run_dialog",
    "save_as",
]

_BELOW_BAR = 96  # px below the top of the main window: the bar with STOP stays uncovered


def run_dialog(dialog: QDialog, session: Session) -> bool:
    """Show ``dialog`` until it is answered; return True if it was accepted."""
    parent = dialog.parentWidget()
    busy = session.busy
    dialog.setModal(not busy)
    dialog.setWindowModality(
        Qt.WindowModality.NonModal if busy else Qt.WindowModality.ApplicationModal
    )
    if isinstance(dialog, QFileDialog):
        dialog.setOption(QFileDialog.Option.DontUseNativeDialog, busy)
    loop = QEventLoop()
    dialog.finished.connect(loop.quit)
    dialog.show()
    if busy and parent is not None:
        top = parent.window().mapToGlobal(QPoint(0, _BELOW_BAR)).y()
        if dialog.frameGeometry().top() < top:
            dialog.move(dialog.x(), top)
    loop.exec()
    return dialog.result() == QDialog.DialogCode.Accepted.value


def choose_file(
    parent: QWidget, session: Session, title: str, folder: Path | str, kinds: str
) -> Path | None:
    """Return an existing file of ``kinds``, as in "Models (*.toml)"; None where none was chosen."""
    dialog = QFileDialog(parent, title, str(folder), kinds)
    dialog.setFileMode(QFileDialog.FileMode.ExistingFile)
    return _chosen(dialog, session)


def choose_files(
    parent: QWidget, session: Session, title: str, folder: Path | str, kinds: str
) -> list[Path]:
    """Return existing files of ``kinds``; none where none was chosen."""
    dialog = QFileDialog(parent, title, str(folder), kinds)
    dialog.setFileMode(QFileDialog.FileMode.ExistingFiles)
    return [Path(n) for n in dialog.selectedFiles() if n] if run_dialog(dialog, session) else []


def save_as(
    parent: QWidget, session: Session, title: str, start: Path | str, kinds: str, ending: str
) -> Path | None:
    """Return the file to write, with ``ending`` (".toml") where none was typed, or None.

    ``start`` is a folder, or the file that is proposed.
    """
    start = Path(start)
    is_folder = start.is_dir()
    dialog = QFileDialog(parent, title, str(start if is_folder else start.parent), kinds)
    dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
    dialog.setDefaultSuffix(ending.removeprefix("."))  # and asks before a file is replaced
    if not is_folder:
        dialog.selectFile(start.name)
    return _chosen(dialog, session)


def choose_folder(parent: QWidget, session: Session, title: str, folder: Path | str) -> Path | None:
    """Return an existing folder, None where none was chosen."""
    dialog = QFileDialog(parent, title, str(folder))
    dialog.setFileMode(QFileDialog.FileMode.Directory)
    dialog.setOption(QFileDialog.Option.ShowDirsOnly)
    return _chosen(dialog, session)


def ask(parent: QWidget, session: Session, title: str, question: str, yes: str, no: str) -> bool:
    """Return True if the button ``yes`` was pressed; ``no`` is the default, and Esc means it."""
    box = QMessageBox(QMessageBox.Icon.Question, title, question, parent=parent)
    box.setTextFormat(Qt.TextFormat.PlainText)
    accepted = box.addButton(yes, QMessageBox.ButtonRole.AcceptRole)
    refused = box.addButton(no, QMessageBox.ButtonRole.RejectRole)
    box.setDefaultButton(refused)
    box.setEscapeButton(refused)
    run_dialog(box, session)
    return box.clickedButton() is accepted


def ask_text(
    parent: QWidget, session: Session, title: str, question: str, text: str = ""
) -> str | None:
    """Return a line of text without blanks around it, None where the question was cancelled."""
    dialog = QInputDialog(parent)
    dialog.setWindowTitle(title)
    dialog.setLabelText(question)
    dialog.setTextValue(text)
    return dialog.textValue().strip() if run_dialog(dialog, session) else None


def _chosen(dialog: QFileDialog, session: Session) -> Path | None:
    if not run_dialog(dialog, session):
        return None
    return next((Path(name) for name in dialog.selectedFiles() if name), None)
