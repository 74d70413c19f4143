"""A page of the window is registered in one line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from PySide6.QtCore import QSettings
from pytestqt.qtbot import QtBot

import dearig.window
from dearig.window.kit.theme import LIGHT
from dearig.window.session.page import Page
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile
from dearig.window.shell import frame
from dearig.window.shell.frame import MainWindow
from dearig.window.shell.pages import PAGES


class NotesPage(Page):
    """A page as somebody adds it: one class."""

    title = "Notes"
    edits = "note"

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.done: list[str] = []
        self.session = session

    def reset_layout(self) -> None:
        self.done.append("reset")

    def close_work(self) -> None:
        self.done.append("closed")

    def restore(self, text: str, file: EditedFile) -> None:
        self.done.append(f"restored {text} of {file.what}")


@pytest.fixture
def added(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frame, "PAGES", (*PAGES, NotesPage))


def start(folder: Path, qtbot: QtBot) -> MainWindow:
    settings = QSettings(str(folder / "dearig.ini"), QSettings.Format.IniFormat)
    window = MainWindow(Session(folder, settings, theme=LIGHT))
    qtbot.addWidget(window)
    return window


def test_one_line_lists_makes_resets_restores_and_closes_a_page(
    added: None, tmp_path: Path, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    window = start(tmp_path, qtbot)
    row = len(PAGES)
    assert window.list.item(row).text() == "Notes"
    assert window.list.item(row).toolTip() == f"Notes (Ctrl+{row + 1})"
    assert not isinstance(window.stack.widget(row), NotesPage)  # no one has needed it yet
    keys = {action.shortcut().toString(): action for action in window.actions()}
    keys[f"Ctrl+{row + 1}"].trigger()
    page = window.page(NotesPage)
    assert window.stack.currentWidget() is page

    monkeypatch.setattr(
        frame,
        "offer_unsaved",
        lambda _window, _session, restore: restore["note"]("my text", EditedFile("note", "")),
    )
    window.offer_unsaved()
    window.reset_layout()
    window.show_page(page)
    assert window.close()
    assert page.done == ["restored my text of note", "reset", "closed"]

    again = start(tmp_path, qtbot)
    assert isinstance(again.stack.currentWidget(), NotesPage)
    assert again.close()


def test_a_page_of_one_line_reaches_the_others(added: None, tmp_path: Path, qtbot: QtBot) -> None:
    window = start(tmp_path, qtbot)
    page = window.page(NotesPage)
    toml = 'name = "from a page"\n[[segment]]\nkind = "hold"\nvoltage_kV = 1.0\nduration_s = 1.0\n'
    page.edit_sequence.emit(toml)
    assert window.stack.currentWidget() is window.sequence_page
    assert window.session.sequence_toml == toml
    file = tmp_path / "played.toml"
    page.play_sequence.emit(toml.replace("1.0", "2.0"), file)
    assert window.stack.currentWidget() is window.run_page
    assert window.session.sequence_path == file
    page.go_to.emit("Study")
    assert window.list.currentItem().text() == "Study"
    assert window.close()


def test_keys_and_titles_of_the_pages_differ() -> None:
    assert len({kind.title for kind in PAGES}) == len(PAGES) <= 9  # Ctrl+1 to Ctrl+9
    edited = [kind.edits for kind in PAGES if kind.edits]
    assert len(set(edited)) == len(edited)


def test_every_page_that_is_asked_for_by_its_title_is_in_the_list() -> None:
    folder = Path(dearig.window.__file__).parent
    named = {
        title
        for file in folder.rglob("*.py")
        for title in re.findall(r'go_to\.emit\("(.+?)"\)', file.read_text(encoding="utf-8"))
    }
    assert named
    assert named <= {kind.title for kind in PAGES}
