"""What the window shows: names as they are and not as HTML, no keys of files, no word cut off."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import QSettings
from PySide6.QtWidgets import QLabel, QPushButton, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from dearig.config.presets import PRESETS
from dearig.config.rigfile import RigFile
from dearig.report.study_view import view_of
from dearig.window.kit.theme import LIGHT, prepare_plots
from dearig.window.kit.widgets import label
from dearig.window.recordings.page import RecordingsPage
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from dearig.window.study.page import StudyPage
from tests.report.test_study_file import made as study_on_paper
from tests.tools.diagnosis import diagnose_outcome
from tests.window.made_recordings import made
from tests.window.shown_text import cut_off, rendered_markup, shown_texts, unreadable

TAG, WITHIN = "<b>", "bold"
HOSTILE = "<b>bold</b><img src=//host/x.png>"
REFUSED = """\
name = "too much"
[[segment]]
kind = "half_sine"
amplitude_kV = 12.0
frequency_Hz = 0.5
"""
_PATIENCE = 60_000  # ms


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder whose name, files, films, operators and notes look like HTML."""
    if sys.platform == "win32":
        pytest.skip("no name of a file can look like a tag")
    folder = tmp_path / "<img src=//host" / "x.png><b>bold<" / "b>"
    folder.mkdir(parents=True)
    made(folder, "<b>bold", operator=HOSTILE, film_id=HOSTILE, notes=HOSTILE)
    made(folder, "<b>bold2", 4.0, operator="Ada", film_id=HOSTILE, notes="")
    return folder


def test_every_page_shows_whole_words_without_keys_and_markup(
    folder: Path, tmp_path: Path, qtbot: QtBot
) -> None:
    prepare_plots()
    settings = QSettings(str(tmp_path / "dearig.ini"), QSettings.Format.IniFormat)
    session = Session(folder, settings, theme=LIGHT)
    window = MainWindow(session)
    qtbot.addWidget(window)
    window.resize(1366, 768)
    window.show()
    wrong: list[str] = []

    def look(state: str) -> None:
        qtbot.wait(1)  # what is laid out later is laid out now
        texts = list(shown_texts(window))
        for found in (cut_off(window), unreadable(texts), rendered_markup(texts, WITHIN, TAG)):
            wrong.extend(f"{state}: {words}" for words in found)

    def until(condition: Callable[[], bool]) -> None:
        qtbot.waitUntil(condition, timeout=_PATIENCE)

    until(lambda: session.preview is not None)
    session.set_notes(HOSTILE, HOSTILE, HOSTILE)
    session.set_rig_file(folder / "<b>bold.toml", "", RigFile())
    for page in window.pages:
        window.show_page(page)
        look(f"{page.title} at the start")

    recordings = window.page(RecordingsPage)
    window.show_page(recordings)
    names = [folder / "<b>bold.h5", folder / "<b>bold2.h5"]
    until(lambda: len(recordings._library.summaries) == 2)
    look("Recordings, listed")
    recordings.choose(names[:1])
    until(lambda: len(recordings.plot.shown) == 1)
    look("Recordings, one")
    recordings.choose(names)
    until(lambda: len(recordings.plot.shown) == 2)
    look("Recordings, two")

    study = window.page(StudyPage)
    window.show_page(study)
    study.recordings.check(names[:1], names[1:])
    study.show_view(view_of(study_on_paper(folder / "study-1", diagnose_outcome(title=HOSTILE))))
    for index in range(study.tabs.count()):
        study.tabs.setCurrentIndex(index)
        look(f"Study, {study.tabs.tabText(index)}")

    session.set_sequence(REFUSED.replace("too much", HOSTILE), folder, folder / "<b>bold.toml")
    until(lambda: session.preview is not None and HOSTILE in session.preview.toml)
    session.message.emit(HOSTILE)
    for page in (window.sequence_page, window.run_page):
        window.show_page(page)
        look(f"{page.title}, refused")
    session.set_sequence(PRESETS["thesis"], folder)
    until(lambda: session.preview is not None and session.preview.toml == PRESETS["thesis"])
    look("Run, ready")
    assert wrong == []
    assert window.close()


def test_the_look_at_the_window_sees_what_is_wrong(qtbot: QtBot) -> None:
    for text in ("amplitude_kV", "+-5 V", "3 us"):
        assert len(unreadable(shown_texts(_shown(label(text), qtbot)))) == 1, text
    for widget, wrong in ((QLabel(HOSTILE), 1), (label(HOSTILE), 0)):
        texts = shown_texts(_shown(widget, qtbot))
        assert len(rendered_markup(texts, WITHIN, TAG)) == wrong
    for widget in (label("a long text"), QPushButton("a long text")):
        window = _shown(widget, qtbot)
        assert cut_off(window) == []
        widget.setFixedWidth(20)
        assert len(cut_off(window)) == 1


def _shown(widget: QWidget, qtbot: QtBot) -> QWidget:
    """Show ``widget`` in a window of its own, and return the window."""
    window = QWidget()
    qtbot.addWidget(window)
    QVBoxLayout(window).addWidget(widget)
    window.show()
    return window
