"""File of an edited text: where its dialogs begin, and what happens with the answers."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from dearig.window.documents.file_actions import FileActions
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile


class Editor(QWidget):
    def __init__(self, session: Session, file: EditedFile) -> None:
        super().__init__()
        self.text, self.file = file.saved, file
        self.files = FileActions(self, session, "rig file", lambda: (self.text, self.file))
        self.files.opened.connect(self.take)

    def take(self, text: str, file: EditedFile) -> None:
        self.text, self.file = text, file

    def close_work(self) -> None:
        self.files.close()


@pytest.mark.parametrize("known", ["file", "folder", "neither"])
def test_a_dialog_begins_where_the_text_comes_from(
    session: Session, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, known: str
) -> None:
    path = tmp_path / "mine.toml"
    file = EditedFile(
        "rig file",
        "",
        path if known == "file" else None,
        tmp_path / "waveforms" if known == "folder" else Path(),
    )
    editor = Editor(session, file)
    qtbot.addWidget(editor)
    begun: list[Path] = []
    for name in ("choose_file", "save_as"):
        monkeypatch.setattr(
            f"dearig.window.documents.file_actions.{name}",
            lambda _parent, _session, _title, start, *_: begun.append(start),
        )
    editor.files.ask_open()
    editor.files.save() if known != "file" else editor.files.ask_save()
    where = {"file": path, "folder": tmp_path / "waveforms", "neither": session.folder}[known]
    assert begun == [where, where]


def test_a_chosen_file_is_read_and_saved_again(
    session: Session, qtbot: QtBot, tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("a = 1\n")
    editor = Editor(session, EditedFile("rig file", ""))
    qtbot.addWidget(editor)
    with qtbot.waitSignal(editor.files.opened):
        editor.files.open(path)
    assert (editor.text, editor.file.path, editor.file.folder) == ("a = 1\n", path, tmp_path)
    editor.text = "a = 2\n"
    editor.files.note()
    assert editor.files.name.text() == "● mine.toml (not saved)"
    with qtbot.waitSignal(editor.files.saved):
        editor.files.save()
    assert path.read_text() == "a = 2\n"
    editor.files.close()
