"""A window for a test, with a rig that is simulated, and a word from Qt that fails it."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Generator, Iterator
from pathlib import Path

import pytest

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")  # before Qt is loaded

from PySide6.QtCore import (
    QCoreApplication,
    QEvent,
    QEventLoop,
    QMessageLogContext,
    QSettings,
    Qt,
    QtMsgType,
    qInstallMessageHandler,
)
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from dearig.config.presets import PRESETS
from dearig.config.rigfile import RigFile
from dearig.drivers.settings import LimitsSettings
from dearig.window.campaign.page import CampaignPage
from dearig.window.jobs.worker import Worker
from dearig.window.kit.theme import LIGHT, prepare_plots
from dearig.window.run.controls import StepButton
from dearig.window.run.page import RunPage
from dearig.window.run.runner import Runner
from dearig.window.sequence.planner import Planner
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow

# the offscreen platform says this of windows that it shows, and means nothing by it
_ALLOWED = (
    "This plugin does not support propagateSizeHints()",
    "This plugin does not support raise()",
    "This plugin does not support grabbing the keyboard",
)

SHARED = "shared"  #: property of a window that further tests use

SHORT = """\
name = "one lobe"
lead_in_s = 0.3
tail_s = 0.2
[[segment]]
kind = "half_sine"
amplitude_kV = 6.0
frequency_Hz = 2.0
"""


def end_run(runner: Runner) -> None:
    """End the run or campaign of ``runner``, and wait for its thread."""
    while runner.running:
        runner.stop("the end of the test")
        runner.wait()
        QCoreApplication.processEvents()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_teardown() -> Generator[None]:
    """Close what a failed test left in any state: no one is there to answer a question.

    pytest-qt closes the windows before any fixture ends, and destroys them. The thread of a run
    must have ended by then, or Qt ends the whole process.
    """
    for widget in QApplication.topLevelWidgets() if QApplication.instance() else ():
        if isinstance(widget, MainWindow):
            if not widget.property(SHARED):
                widget.leave()
            end_run(widget.run_page.runner)
        elif isinstance(widget, RunPage):
            end_run(widget.runner)
    yield


@pytest.fixture(autouse=True, scope="module")
def _old_objects_are_not_searched() -> None:
    """What libraries and compiled kernels keep is millions of objects: a second for each test."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _no_style_sheet_of_an_earlier_window(qapp: QApplication) -> None:
    """As at the start of the program: with a sheet, Qt restyles each part that is put in place."""
    if not any(isinstance(widget, MainWindow) for widget in qapp.topLevelWidgets()):
        qapp.setStyleSheet("")


@pytest.fixture(autouse=True)
def _garbage_is_collected_here(qapp: QApplication) -> Iterator[None]:
    """As in the program: never in another thread, where a widget must not be destroyed."""
    gc.disable()
    yield
    # what was closed is deleted before the next test, and in this thread
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)
    gc.collect()
    gc.freeze()  # what is left is not searched again after each further test
    gc.enable()


@pytest.fixture(autouse=True)
def _no_word_from_qt() -> Iterator[None]:
    said: list[str] = []

    def hear(kind: QtMsgType, context: QMessageLogContext, message: str) -> None:
        if message not in _ALLOWED:
            said.append(f"{kind.name}: {message}")

    before = qInstallMessageHandler(hear)
    yield
    qInstallMessageHandler(before)
    assert said == []


def press(qtbot: QtBot, step: StepButton) -> None:
    """Click a step towards voltage as an operator does: once it can be, and is seen to be."""
    qtbot.waitUntil(lambda: step.isEnabled() and step.answers, timeout=120_000)
    qtbot.mouseClick(step, Qt.MouseButton.LeftButton)


def strike(place: QWidget, *keys: Qt.Key | str) -> None:
    """Strike keys with the focus at ``place``, by way of the window system as an operator does."""
    top = place.window()
    top.activateWindow()
    while QApplication.focusWindow() is not top.windowHandle():
        QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.WaitForMoreEvents)
    place.setFocus()
    for key in keys:
        QTest.keyClick(top.windowHandle(), key)


class Answers:
    """Answers to the questions of the window, in place of a dialog."""

    def __init__(self) -> None:
        self.next = False
        self.questions: list[str] = []

    def __call__(self, *given: object) -> bool:
        self.questions.append(str(given[3]))
        return self.next


@pytest.fixture
def answers(monkeypatch: pytest.MonkeyPatch) -> Answers:
    given = Answers()
    monkeypatch.setattr("dearig.window.documents.questions.ask", given)
    return given


def new_session(parent: Path) -> Session:
    """Return a session with settings and a folder of recordings in ``parent``."""
    prepare_plots()
    settings = QSettings(str(parent / "settings.ini"), QSettings.Format.IniFormat)
    folder = parent / "recordings"
    folder.mkdir()
    return Session(folder, settings, theme=LIGHT)


@pytest.fixture
def session(tmp_path: Path, qapp: QApplication) -> Session:
    return new_session(tmp_path)


@pytest.fixture
def quick_ramp(session: Session) -> Session:
    """A rig that is at 0 V a tenth of a second after STOP."""
    session.set_rig_file(None, "", RigFile(limits=LimitsSettings(ramp_down_s=0.1)))
    return session


@pytest.fixture
def keep(qtbot: QtBot) -> Iterator[Callable[[QWidget], None]]:
    """Show a page or window of its own, and end its threads and processes after the test."""
    kept: list[QWidget] = []

    def show(widget: QWidget) -> None:
        qtbot.addWidget(widget)
        kept.append(widget)
        with qtbot.waitActive(widget):  # keys go to the window that is active
            widget.show()
            widget.activateWindow()

    yield show
    for widget in kept:
        if isinstance(widget, MainWindow):
            widget.leave()  # without a question
        else:
            widget.close_work()  # type: ignore[attr-defined]


@pytest.fixture
def window(
    session: Session,
    keep: Callable[[QWidget], None],
    qtbot: QtBot,
    monkeypatch: pytest.MonkeyPatch,
) -> MainWindow:
    """The whole window with its first plan made; its simulated rig does not take its time.

    A page is made when it is opened, not before the rig is armed, and the page Campaign not at the
    start: all pages are two seconds.
    """
    monkeypatch.setattr(CampaignPage, "at_start", False)
    shown = MainWindow(session)
    shown.idle_pages.close()
    shown.resize(1366, 768)
    keep(shown)
    qtbot.waitUntil(lambda: session.preview is not None, timeout=120_000)
    shown.run_page.paced.setChecked(False)
    return shown


@pytest.fixture(scope="module")
def shared_window(
    qapp: QApplication, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[MainWindow]:
    """A window as ``window``, for all tests of a file that leave no trace; see ``put_back``."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(CampaignPage, "at_start", False)
        shown = MainWindow(new_session(tmp_path_factory.mktemp("shared")))
    shown.setProperty(SHARED, True)
    shown.idle_pages.close()
    shown.resize(1366, 768)
    shown.show()
    shown.activateWindow()
    assert QTest.qWaitForWindowActive(shown)
    yield shown
    shown.leave()
    shown.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)


class KeptWorker(Worker):
    """A worker whose process stays for the next page: to start one takes two seconds."""

    def close(self) -> None:
        """Drop all jobs; a late answer of the last one counts no longer."""
        self._urgent.clear()
        self._waiting.clear()
        self._current = None


@pytest.fixture(scope="module")
def kept_processes(qapp: QApplication) -> Iterator[None]:
    """One process that reads recordings, and one that makes studies, for all pages of a file."""
    with pytest.MonkeyPatch.context() as patch:
        workers = {name: KeptWorker() for name in ("recordings.library", "study.page")}
        for name, worker in workers.items():
            patch.setattr(f"dearig.window.{name}.Worker", lambda *_, worker=worker: worker)
        yield
        for worker in workers.values():
            Worker.close(worker)


def put_back(window: MainWindow, qtbot: QtBot) -> MainWindow:
    """Return ``window`` disarmed, with the rig, the sequence and the page of the first start."""
    session, page = window.session, window.run_page
    end_run(page.runner)
    page.stop()  # which disarms
    assert not page.runner.armed
    assert session.blocks == {}
    window.activateWindow()
    window.show_page(page)
    page.paced.setChecked(False)
    page.operator.setText("")
    session.set_address("sim")
    session.set_rig_file(None, "", RigFile())
    session.set_sequence(PRESETS["thesis"], Path())
    qtbot.waitUntil(
        lambda: session.preview is not None and session.preview.toml == PRESETS["thesis"],
        timeout=120_000,
    )
    return window


@pytest.fixture
def run_page(session: Session, keep: Callable[[QWidget], None], qtbot: QtBot) -> Iterator[RunPage]:
    """The page alone, with its first plan made."""
    planner, page = Planner(session), RunPage(session)
    page.resize(1200, 700)
    keep(page)
    planner.renew()
    qtbot.waitUntil(lambda: session.preview is not None, timeout=120_000)
    page.paced.setChecked(False)
    yield page
    page.close_work()
    planner.close()


@pytest.fixture
def plan_of(session: Session, qtbot: QtBot) -> Callable[[str], None]:
    """Put another sequence in, and wait for its plan."""

    def put(toml: str) -> None:
        session.set_sequence(toml, Path())
        qtbot.waitUntil(
            lambda: session.preview is not None and session.preview.toml == toml, timeout=120_000
        )

    return put
