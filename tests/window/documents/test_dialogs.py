"""Dialogs of every kind: none takes STOP away while the rig is armed or a run goes on."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QApplication, QDialog, QFileDialog
from pytestqt.qtbot import QtBot

import dearig.window
from dearig.window.documents import dialogs
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from tests.deep import mostly_deep
from tests.window.conftest import press

LEFT = Qt.MouseButton.LeftButton
RUN_MS = 60_000
KINDS: dict[str, Callable[[MainWindow, Session], object]] = {
    "choose_file": lambda w, s: dialogs.choose_file(w, s, "Open", s.folder, "Models (*.toml)"),
    "save_as": lambda w, s: dialogs.save_as(w, s, "Save", s.folder, "Models (*.toml)", ".toml"),
    "choose_folder": lambda w, s: dialogs.choose_folder(w, s, "Folder", s.folder),
    "ask": lambda w, s: dialogs.ask(w, s, "Changes", "Discard them?", "Discard", "Keep"),
    "ask_text": lambda w, s: dialogs.ask_text(w, s, "Mark", "Note"),
}


def opened() -> QDialog | None:
    shown = (w for w in QApplication.topLevelWidgets() if isinstance(w, QDialog))
    return next((w for w in shown if w.isVisible()), None)


@pytest.mark.parametrize("kind", mostly_deep(KINDS, ["save_as"]))
def test_stop_works_beside_an_open_dialog(
    qtbot: QtBot, quick_ramp: Session, window: MainWindow, kind: str
) -> None:
    page, session = window.run_page, window.session
    page.paced.setChecked(True)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)
    saw: list[str] = []

    def look() -> None:
        dialog = opened()
        assert dialog is not None
        if dialog.isModal() or QApplication.activeModalWidget() is not None:
            saw.append("modal")
        if isinstance(dialog, QFileDialog) and not dialog.testOption(
            QFileDialog.Option.DontUseNativeDialog
        ):
            saw.append("native")
        below = window.bar.mapToGlobal(window.bar.rect().bottomLeft()).y()
        if dialog.frameGeometry().top() < below:
            saw.append("covers the bar")
        qtbot.mouseClick(window.bar.stop_button, LEFT)
        saw.append(page.runner.state.name)
        dialog.reject()

    QTimer.singleShot(100, look)
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS):
        assert not KINDS[kind](window, session)
    assert saw == ["RAMPING"]


@pytest.mark.parametrize("kind", mostly_deep(KINDS, ["choose_file"]))
def test_nothing_is_armed_while_a_dialog_waits_for_its_answer(
    qtbot: QtBot, window: MainWindow, kind: str
) -> None:
    saw: list[bool] = []

    def look() -> None:
        dialog = opened()
        assert dialog is not None
        saw.append(dialog.isModal())
        dialog.reject()

    QTimer.singleShot(50, look)
    KINDS[kind](window, window.session)
    assert saw == [True]


def test_a_question_is_answered_no_by_default(qtbot: QtBot, window: MainWindow) -> None:
    def press_return() -> None:
        dialog = opened()
        assert dialog is not None
        qtbot.keyClick(dialog, Qt.Key.Key_Return)

    QTimer.singleShot(50, press_return)
    assert not KINDS["ask"](window, window.session)


def test_all_dialogs_of_the_window_go_through_one_module() -> None:
    folder = Path(dearig.window.__path__[0])
    direct = re.compile(
        r"QFileDialog\.get|QInputDialog\.get|QMessageBox\.(question|warning|information|critical)"
        r"|\b(?!application|loop)\w+\.exec\("
    )
    found = [
        f"{path.name}: {line.strip()}"
        for path in sorted(folder.glob("*.py"))
        if path.name != "dialogs.py"
        for line in path.read_text(encoding="utf-8").splitlines()
        if direct.search(line)
    ]
    assert found == []
