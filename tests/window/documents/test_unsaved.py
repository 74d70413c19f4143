"""Unsaved work is asked about, or kept for the next start."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import QSettings, Qt, QTimer
from PySide6.QtWidgets import QApplication, QMessageBox, QWidget
from pytestqt.qtbot import QtBot

from dearig.config.presets import PRESETS
from dearig.window.documents.dialogs import ask
from dearig.window.documents.questions import confirm_discard
from dearig.window.kit.theme import LIGHT
from dearig.window.rig.page import RigPage
from dearig.window.session.recovery import Recovery
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from tests.window.conftest import Answers


def unsaved_folder(session: Session) -> Path:
    return Path(session.settings.fileName()).parent / "unsaved"


def change(window: MainWindow) -> None:
    window.sequence_page.preset("rich")
    window.sequence_page.editor.choose(1)
    window.sequence_page.editor.set_value("duration_s", 2.0)
    window.page(RigPage).set_value("limits", "voltage_max_kV", 5.0)


def test_closing_asks_and_names_what_would_be_lost(window: MainWindow, answers: Answers) -> None:
    assert not window.isWindowModified()
    change(window)
    assert window.isWindowModified()
    assert window.close() is False
    (question,) = answers.questions
    assert "segment 2 duration (s)" in question
    assert "limits: voltage max (kV)" in question
    window.session.recovery.write()
    assert len(list(unsaved_folder(window.session).glob("*.json"))) == 1
    answers.next = True
    assert window.close() is True
    assert list(unsaved_folder(window.session).iterdir()) == []


def test_a_signal_keeps_unsaved_work_for_the_next_start(
    window: MainWindow, answers: Answers, keep: Callable[[QWidget], None], qtbot: QtBot
) -> None:
    change(window)
    window.sequence_page.editor.draft.file.path = window.session.folder / "mine.toml"
    toml, rig = window.sequence_page.draft.toml, window.page(RigPage).text
    window.leave()
    assert not window.isVisible()
    assert answers.questions == []
    settings = QSettings(window.session.settings.fileName(), QSettings.Format.IniFormat)
    session = Session(window.session.folder, settings, theme=LIGHT)
    again = MainWindow(session)
    keep(again)
    again.offer_unsaved()  # "Not now": it is offered again
    assert again.sequence_page.draft.toml == PRESETS["thesis"]
    answers.next = True
    again.offer_unsaved()
    assert "sequence mine.toml (changed: segment 2 duration (s))" in answers.questions[1]
    assert again.sequence_page.draft.toml == session.sequence_toml == toml
    assert again.page(RigPage).text == rig
    assert session.rig_file.limits.voltage_max_kV == 5.0
    assert again.sequence_page.files.name.text() == "● mine.toml (not saved)"
    assert again.isWindowModified()
    again.offer_unsaved()
    assert len(answers.questions) == 2
    assert len(list(unsaved_folder(session).glob("*.json"))) == 1  # its own


@pytest.mark.deep
def test_the_work_of_a_window_that_is_open_is_not_offered(
    window: MainWindow, answers: Answers
) -> None:
    change(window)
    window.session.recovery.write()
    other = Recovery(window.session.settings)
    assert list(other.found()) == []
    answers.next = True
    window.close()


@pytest.mark.parametrize(
    "content", ["", "{}", "[1]", '{"format": "dearig-unsaved/9", "texts": {}}', "\0"]
)
def test_a_damaged_recovery_file_is_passed_over(session: Session, content: str) -> None:
    folder = unsaved_folder(session)
    folder.mkdir()
    (folder / "1-a.json").write_text(content)
    assert list(session.recovery.found()) == []


def test_the_default_of_a_question_loses_nothing(
    window: MainWindow, qtbot: QtBot, answers: Answers, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dearig.window.documents.questions.ask", ask)
    change(window)
    page = window.sequence_page
    pressed: list[str] = []

    def press() -> None:
        box = QApplication.activeModalWidget()
        assert isinstance(box, QMessageBox)
        pressed.append(box.defaultButton().text())
        assert "segment 2 duration (s)" in box.text()
        qtbot.keyClick(box, Qt.Key.Key_Return)

    QTimer.singleShot(0, press)
    assert not confirm_discard(page, window.session, page.draft.file, page.draft.toml)
    assert pressed == ["Cancel"]
    monkeypatch.setattr("dearig.window.documents.questions.ask", answers)
    answers.next = True
    window.close()
