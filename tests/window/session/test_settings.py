"""Settings kept by the window: what is damaged counts as missing."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from PySide6.QtCore import QSettings
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from dearig.window.kit.theme import LIGHT, prepare_plots
from dearig.window.session.settings import kept_texts, open_settings, write_apart
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from tests.deep import mostly_deep

DAMAGED = {
    "geometry cut": b"[General]\ngeometry=@ByteArray(\\x1\\xd9\\xd0\\xcb\\0\\x3",
    "geometry a text": b"[General]\ngeometry=hello\n",
    "geometry a list": b"[General]\ngeometry=a, b, c\n",
    "page empty": b"[General]\npage=\n",
    "page a word": b"[General]\npage=run\n",
    "page far away": b"[General]\npage=99999999999999999999999999\n",
    "page negative": b"[General]\npage=-5\n",
    "page a list": b"[General]\npage=1, 2\n",
    "page of bytes": b"[General]\npage=@ByteArray(\\x1\\x2)\n",
    "unknown variants": b"[General]\npage=@Variant(\\0\\0)\noperator=@Variant(\\0\\0\\0)\n",
    "recent a number": b"[General]\nrecent=3\n",
    "recent of bytes": b"[General]\nrecent=@ByteArray(\\0)\n",
    "texts as lists": b"[General]\noperator=a, b\nfilm=c, d\ncolour_scheme=e, f\n",
    "layout": b"[layout]\nrecordings\\rows=x, y\nrecordings\\columns=@Size(1 2)\n",
    "zeros": b"\0" * 200,
    "empty": b"",
    "not UTF-8": bytes(range(128, 256)) * 10,
}


#: A value out of range, for those of another type, and for no settings file.
KEPT = ("page far away",)


@pytest.mark.parametrize("name", mostly_deep(DAMAGED, KEPT))
def test_the_window_opens_whatever_the_settings_file_holds(
    tmp_path: Path, qtbot: QtBot, name: str
) -> None:
    ini = tmp_path / "dearig.ini"
    ini.write_bytes(DAMAGED[name])
    prepare_plots()
    settings = QSettings(str(ini), QSettings.Format.IniFormat)
    window = MainWindow(Session(tmp_path, settings, theme=LIGHT))
    qtbot.addWidget(window)
    assert 0 <= window.list.currentRow() < len(window.pages)
    assert all(isinstance(path, Path) for path in window.session.recent)
    assert isinstance(window.session.operator, str)
    assert window.close()


def test_what_was_kept_comes_back(tmp_path: Path, qtbot: QtBot) -> None:
    settings = QSettings(str(tmp_path / "dearig.ini"), QSettings.Format.IniFormat)
    session = Session(tmp_path, settings, theme=LIGHT)
    session.set_notes("Ada, Lovelace", "film 3", "")
    for name in ("a.toml", "b.toml"):
        session.add_recent(tmp_path / name)
    settings.sync()
    again = QSettings(str(tmp_path / "dearig.ini"), QSettings.Format.IniFormat)
    found = Session(tmp_path, again, theme=LIGHT)
    assert (found.operator, found.film) == ("Ada, Lovelace", "film 3")
    assert found.recent == [tmp_path / "b.toml", tmp_path / "a.toml"]
    assert kept_texts(again, "recent", 1) == [str(tmp_path / "b.toml")]


def test_nothing_is_written_to_the_disk_while_stop_must_be_heard(
    tmp_path: Path, qtbot: QtBot
) -> None:
    ini = tmp_path / "dearig.ini"
    session = Session(tmp_path, QSettings(str(ini), QSettings.Format.IniFormat), theme=LIGHT)
    session.settings.setValue("page", 1)
    qtbot.waitUntil(ini.exists)
    before = ini.read_bytes()
    session.set_armed(True)
    session.settings.setValue("page", 2)
    QApplication.processEvents()
    session.set_running(True)
    session.set_armed(False)
    session.settings.setValue("page", 3)
    QApplication.processEvents()
    assert ini.read_bytes() == before
    assert session.settings.value("page") == 3
    session.set_running(False)
    assert b"page=3" in ini.read_bytes()
    session.settings.setValue("page", 4)
    qtbot.waitUntil(lambda: b"page=4" in ini.read_bytes())


def test_settings_are_written_in_a_thread_of_their_own(tmp_path: Path, qtbot: QtBot) -> None:
    ini = tmp_path / "dearig.ini"
    session = Session(tmp_path, QSettings(str(ini), QSettings.Format.IniFormat), theme=LIGHT)
    session.set_armed(True)
    session.settings.setValue("alarm", "arc")
    write_apart(session.settings).join()
    assert b"alarm=arc" in ini.read_bytes()


@pytest.mark.skipif(os.name == "nt", reason="settings are in the registry")
def test_settings_that_another_user_may_change_are_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "config").mkdir()
    kept = QSettings.Format.NativeFormat
    QSettings.setPath(kept, QSettings.Scope.UserScope, str(tmp_path / "config"))
    try:
        monkeypatch.setattr(
            "dearig.window.session.settings.QSettings",
            lambda *given: QSettings(*(given or ("dearig-test", "dearig-test"))),
        )
        monkeypatch.setattr(
            "dearig.window.session.settings.QSettings.Format", QSettings.Format, raising=False
        )
        mine = open_settings()
        mine.setValue("operator", "Ada")
        mine.sync()
        assert open_settings().value("operator") == "Ada"
        Path(mine.fileName()).chmod(0o666)
        assert open_settings().value("operator") is None
    finally:
        QSettings.setPath(kept, QSettings.Scope.UserScope, str(Path.home() / ".config"))
