"""Errors that nothing has handled: in the window and in the log, each once with a count."""

from __future__ import annotations

import logging
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import QThread, QTimer, Slot
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from dearig.progress import Progress
from dearig.window.jobs.background import Background
from dearig.window.jobs.program_errors import ProgramErrors
from dearig.window.jobs.worker import Worker
from dearig.window.shell.error_panel import ErrorPanel

_PATIENCE = 60_000


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in another folder: a child process finds these functions only then."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def errors(qtbot: QtBot) -> Iterator[ProgramErrors]:
    made = ProgramErrors()
    made.install()
    yield made
    made.close()


@pytest.fixture
def panel(errors: ProgramErrors, qtbot: QtBot) -> ErrorPanel:
    parent = QWidget()
    qtbot.addWidget(parent)
    parent.show()
    made = ErrorPanel(errors, parent)
    parent.panel = made  # type: ignore[attr-defined]  # as long as its parent
    errors.made_for = parent  # type: ignore[attr-defined]
    return made


def fail_in_a_slot(qtbot: QtBot, keep: list) -> None:
    QTimer.singleShot(0, lambda: {}["slot"])


def fail_in_an_override(qtbot: QtBot, keep: list) -> None:
    class Broken(QWidget):
        def paintEvent(self, _: object) -> None:  # noqa: N802
            raise KeyError("override")

    widget = Broken()
    qtbot.addWidget(widget)
    keep.append(widget)
    widget.show()


def fail_in_a_thread(qtbot: QtBot, keep: list) -> None:
    thread = threading.Thread(target=lambda: {}["thread"], name="reader of lamps")
    thread.start()
    thread.join()


def fail_in_a_qthread(qtbot: QtBot, keep: list) -> None:
    class Broken(QThread):
        def run(self) -> None:
            raise KeyError("qthread")

    thread = Broken()
    keep.append(thread)
    thread.start()
    thread.wait()


def fail_in_the_background(qtbot: QtBot, keep: list) -> None:
    background = Background()
    keep.append(background)
    background.start(lambda: {}["background"])


def fail_while_deleted(qtbot: QtBot, keep: list) -> None:
    class Broken:
        def __del__(self) -> None:
            raise KeyError("deleted")

    Broken()


def defective(progress: Progress) -> None:
    raise KeyError("worker")


def unpicklable(progress: Progress) -> object:
    return lambda: None


def fail_in_a_process(qtbot: QtBot, keep: list) -> None:
    worker = Worker()
    keep.append(worker)
    job = worker.submit(defective)
    with qtbot.waitSignal(job.failed, timeout=_PATIENCE):
        pass
    worker.close()


def fail_with_a_result(qtbot: QtBot, keep: list) -> None:
    worker = Worker()
    keep.append(worker)
    job = worker.submit(unpicklable)
    with qtbot.waitSignal(job.failed, timeout=_PATIENCE):
        pass
    worker.close()


KINDS = {
    "slot": fail_in_a_slot,
    "override": fail_in_an_override,
    "thread": fail_in_a_thread,
    "qthread": fail_in_a_qthread,
    "background": fail_in_the_background,
    "deleted": fail_while_deleted,
    "worker": fail_in_a_process,
    "pickle": fail_with_a_result,
}


@pytest.mark.parametrize("word", KINDS)
def test_an_error_of_every_kind_is_in_the_window_and_in_the_log_and_not_on_the_console(
    word: str,
    errors: ProgramErrors,
    panel: ErrorPanel,
    qtbot: QtBot,
    caplog: pytest.LogCaptureFixture,
    capfd: pytest.CaptureFixture[str],
) -> None:
    assert panel.isHidden()
    keep: list = []
    KINDS[word](qtbot, keep)
    qtbot.waitUntil(panel.isVisible, timeout=_PATIENCE)
    assert "Error in the program" in panel.headline.text()
    assert word in panel.words.text().casefold()
    panel.copy_button.click()
    details = QGuiApplication.clipboard().text()
    assert "Traceback" in details
    assert "dearig " in details
    records = [r for r in caplog.records if r.exc_info and r.levelno >= logging.ERROR]
    assert len(records) == 1
    assert "Traceback" not in capfd.readouterr().err


def test_a_storm_of_one_error_is_one_entry_with_a_count(
    errors: ProgramErrors, panel: ErrorPanel, qtbot: QtBot, caplog: pytest.LogCaptureFixture
) -> None:
    class Table(QWidget):
        @Slot()
        def fill(self) -> None:
            raise LookupError("no cell at row 3")

    table = Table()
    qtbot.addWidget(table)
    timer = QTimer()
    timer.timeout.connect(table.fill)
    for _ in range(806):
        timer.timeout.emit()
    qtbot.waitUntil(panel.isVisible)
    qtbot.waitUntil(lambda: "806 times" in panel.headline.text())
    assert len(errors.errors) == 1
    assert panel.words.text().count("no cell at row 3") == 1
    # the first with its traceback, then the counts 10 and 100
    assert len([r for r in caplog.records if r.exc_info]) == 1
    assert len(caplog.records) == 3


def test_what_is_dismissed_comes_back_with_a_different_error_only(
    errors: ProgramErrors, panel: ErrorPanel, qtbot: QtBot
) -> None:
    def one() -> None:
        fail_in_a_thread(qtbot, [])

    one()
    qtbot.waitUntil(panel.isVisible)
    panel.dismiss_button.click()
    with qtbot.waitSignal(errors.changed):
        one()
    assert panel.isHidden()
    panel.show_errors()
    assert "2 times" in panel.headline.text()
    panel.dismiss_button.click()
    fail_while_deleted(qtbot, [])
    qtbot.waitUntil(panel.isVisible)
    assert "2 different errors" in panel.headline.text()


def test_after_the_window_python_has_its_own_handlers_again(qtbot: QtBot) -> None:
    before = sys.excepthook, threading.excepthook, sys.unraisablehook
    errors = ProgramErrors()
    errors.install()
    assert sys.excepthook != before[0]
    errors.close()
    assert (sys.excepthook, threading.excepthook, sys.unraisablehook) == before
