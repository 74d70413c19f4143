"""The first start: the model is compiled in another process, and the window can be used."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from dearig.acquisition import warm_up
from dearig.config.rigfile import RigFile
from dearig.drivers.settings import LimitsSettings
from dearig.progress import Progress, quiet
from dearig.window.session.state import Session
from dearig.window.shell.compilation import Compilation, CompilationBar
from dearig.window.shell.frame import MainWindow
from tests.window.conftest import SHORT

SOON = 300_000  # ms


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in another folder: a child process finds these functions only then."""
    monkeypatch.chdir(tmp_path)


class Slow:
    """Work that lasts until a file appears; it can be sent to another process."""

    def __init__(self, until: Path) -> None:
        self.until = until

    def __call__(self, progress: Progress = quiet) -> None:
        import time

        while not self.until.exists():
            progress("kernel 12 of 40", 0.3)  # raises where the job is cancelled
            time.sleep(0.02)  # in the other process


def broken(progress: Progress = quiet) -> None:
    raise RuntimeError("no compiler")


@pytest.fixture
def first_start(session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot):
    """A window whose model is compiled until a file appears; the window and the file."""
    done = tmp_path / "compiled"

    def made(parent: object) -> Compilation:
        return Compilation(parent, work=Slow(done), needed=lambda: True)  # type: ignore[arg-type]

    monkeypatch.setattr("dearig.window.shell.frame.Compilation", made)
    window = MainWindow(session)
    window.resize(1366, 768)
    qtbot.addWidget(window)
    with qtbot.waitExposed(window):
        window.show()
    yield window, done
    window.close()


@pytest.mark.deep
def test_first_start_says_what_it_does_and_leaves_the_pages_usable(first_start, qtbot: QtBot):
    window, done = first_start
    session = window.session
    bar = window.findChild(CompilationBar)
    assert bar.isVisible()
    assert bar.words.full_text.startswith("Compiling the model once: ")
    qtbot.waitUntil(lambda: "kernel 12 of 40, " in bar.words.full_text, timeout=SOON)
    assert bar.bar.value() == pytest.approx(0.3 * bar.bar.maximum())
    assert not window.run_page.arm_button.isEnabled()
    words = window.run_page.display.view.words
    qtbot.waitUntil(lambda: words.text().startswith("Preview, the model is being compiled"))
    # sequence, rig file and recordings take what is done to them
    session.set_sequence(SHORT, Path())
    session.set_rig_file(None, "", RigFile(limits=LimitsSettings(voltage_max_kV=7.0)))
    for page in window.pages:
        window.show_page(page)
        qtbot.waitUntil(page.isVisible)
    qtbot.keyClick(window.list, Qt.Key.Key_Up)
    assert session.preview is None  # nothing was compiled in this process
    done.touch()
    qtbot.waitUntil(lambda: session.preview is not None, timeout=SOON)
    assert session.preview.toml == SHORT
    assert not bar.isVisible()
    qtbot.waitUntil(window.run_page.arm_button.isEnabled)


def test_a_window_that_is_closed_meanwhile_ends_the_process(first_start, qtbot: QtBot):
    window, _ = first_start
    assert window.compilation.running
    window.close()
    assert not window.compilation.running
    assert not window.compilation._worker.busy


@pytest.mark.deep
def test_what_cannot_be_compiled_is_an_alarm_and_the_plan_is_made_all_the_same(
    session: Session, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot
):
    monkeypatch.setattr(
        "dearig.window.shell.frame.Compilation",
        lambda parent: Compilation(parent, work=broken, needed=lambda: True),
    )
    window = MainWindow(session)
    qtbot.addWidget(window)
    qtbot.waitUntil(lambda: session.preview is not None, timeout=SOON)
    assert "could not be compiled" in window.run_page.alarms.alarms[0].message
    window.close()


def test_without_a_cache_the_model_is_compiled_in_a_thread_of_the_window(qtbot: QtBot):
    threads: list[str] = []
    compilation = Compilation(
        work=lambda: threads.append(threading.current_thread().name),
        needed=lambda: True,
        has_cache=lambda: False,
    )
    bar = CompilationBar(compilation)
    qtbot.addWidget(bar)
    with qtbot.waitSignal(compilation.running_changed, timeout=SOON):
        assert compilation.start()
    assert (bar.bar.minimum(), bar.bar.maximum()) == (0, 0)  # no process tells how far it is
    qtbot.waitUntil(lambda: not compilation.running, timeout=SOON)
    assert threads != []
    assert threads[0] != threading.main_thread().name


def test_a_later_start_compiles_nothing(
    session: Session, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot, tmp_path: Path
):
    monkeypatch.setattr(warm_up, "cache_folder", lambda: tmp_path)
    assert not warm_up.is_warm()
    warm_up.compile_kernels()
    assert warm_up.is_warm()
    compilation = Compilation()
    bar = CompilationBar(compilation)
    qtbot.addWidget(bar)
    assert not compilation.start()
    assert not bar.isVisibleTo(None)
    compilation.close()
