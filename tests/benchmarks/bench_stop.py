"""Delay of a press of STOP while the window does what takes longest, in the midst of a run.

``python -m tests.benchmarks.bench_stop [--repeats 3] [--only Guide]``: a run on the simulated rig
in real time, in a folder of 200 recordings; in its midst each page that was not shown yet is
opened, and each other act of ``acts`` is done, while presses of a key are sent all the time from
another thread. The delay is the time from the sending of the press to its being heard. Work is the
processor time of one turn of the window's loop: a press waits as long on a computer that does
nothing else, and other programs change it little. The first rows are of a window that makes a page
when it is opened, the others of the window as it is.
"""

from __future__ import annotations

import argparse
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")  # before Qt is loaded

import numpy as np
from PySide6.QtCore import QAbstractEventDispatcher, QEventLoop, QSettings, Qt, QTimer
from PySide6.QtWidgets import QApplication, QDialog

from dearig.report.study_view import view_of
from dearig.window.documents.dialogs import ask, choose_file
from dearig.window.jobs.collector import Collector
from dearig.window.kit.theme import LIGHT, prepare_plots
from dearig.window.recordings.page import RecordingsPage
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from dearig.window.shell.pages import PAGES
from dearig.window.study.page import StudyPage
from tests.benchmarks.bench_window import Listener, run_event_loop
from tests.report.test_study_file import made as study_on_paper
from tests.tools.diagnosis import diagnose_outcome
from tests.window.made_recordings import of_rig
from tests.window.real_window import end

PATIENCE = 600.0  # s
MANY = 200  # recordings
SEQUENCE = """\
name = "bench"
[[segment]]
kind = "half_sine"
amplitude_kV = 6.0
frequency_Hz = 0.5
repeats = 1000
"""


class Presses(Listener):
    """Hears presses of STOP, and how long each turn of the window's loop has worked."""

    PAUSE = 0.004  # shorter than any work that counts: one press for each turn of the loop

    def __init__(self) -> None:
        self.worked: list[float] = []
        self._before = time.thread_time()
        self._loop = QAbstractEventDispatcher.instance()
        self._loop.awake.connect(self._turn)
        super().__init__()

    def _turn(self) -> None:
        now = time.thread_time()
        self.worked.append(now - self._before)
        self._before = now

    def close(self) -> None:
        self._loop.awake.disconnect(self._turn)
        super().close()


def until(condition: Callable[[], bool]) -> None:
    """Let the window work until ``condition``."""
    late = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > late:
            raise SystemExit("the window did not get there")
        loop = QEventLoop()
        QTimer.singleShot(10, loop.quit)
        loop.exec()


def many_recordings(folder: Path) -> None:
    """Fill ``folder`` with recordings of the thesis's run."""
    first = of_rig(folder, "thesis-000", "sim:3")
    for number in range(1, MANY):
        shutil.copyfile(first, folder / f"thesis-{number:03d}.h5")


def answered(show: Callable[[], object]) -> None:
    """Show a dialog, and close it after a while."""

    def close() -> None:
        for widget in QApplication.topLevelWidgets():
            if isinstance(widget, QDialog) and widget.isVisible():
                widget.reject()

    QTimer.singleShot(500, close)
    show()


def acts(window: MainWindow, folder: Path) -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield what an operator does during a run, by name; each act follows the one before."""
    session = window.session
    recordings, study = window.page(RecordingsPage), window.page(StudyPage)
    table = recordings.table
    paths = sorted(folder.glob("*.h5"))
    window.show_page(recordings)
    run_event_loop(0.5)
    yield "Recordings: select all", table.selectAll
    yield "Recordings: search", lambda: recordings.filter.setText("thesis-01")
    yield "Recordings: search ends", recordings.filter.clear
    yield "Recordings: sort", lambda: table.sortByColumn(2, Qt.SortOrder.AscendingOrder)
    for place in (1, 2, 3, 0):
        name = recordings.views.tabText(place)
        yield (
            f"Recordings: {name}",
            lambda place=place: recordings.views.setCurrentIndex(place),
        )
    window.show_page(study)
    paper = folder / f"study-{1 + len([*folder.glob('study-*')])}"
    view = view_of(study_on_paper(paper, diagnose_outcome(title="bench")))
    run_event_loop(0.5)  # to open a page is an act of its own
    yield "Study: check all", lambda: study.recordings.check(paths[1:], paths[:1])
    yield "Study: check none", lambda: study.recordings.check([], [])
    yield "Study: a result arrives", lambda: study.show_view(view)
    for place in range(study.tabs.count()):
        name = study.tabs.tabText(place)
        yield f"Study: {name}", lambda place=place: study.tabs.setCurrentIndex(place)
    yield "Guide", window.show_guide
    yield (
        "File chooser",
        lambda: answered(lambda: choose_file(window, session, "Open", folder, "All (*)")),
    )
    yield "Question", lambda: answered(lambda: ask(window, session, "Ask", "Is it?", "Yes", "No"))
    yield "Another colour scheme", lambda: window.set_colour_scheme("dark")
    yield "Error of the program", window.error_panel.show_errors
    yield "Reset layout", window.reset_layout


Heard = tuple[list[float], list[float]]  # ms


def heard(act: Callable[[], object]) -> Heard:
    """Return delays of the presses that are sent while ``act`` is done, and works of turns."""
    listener = Presses()
    run_event_loop(0.2)
    act()
    run_event_loop(0.8)
    listener.close()
    run_event_loop(0.05)
    return [1e3 * delay for delay in listener.delays], [1e3 * work for work in listener.worked]


def measure(ready: bool, folder: Path, only: str, collector: Collector) -> dict[str, Heard]:
    """Return delays and work in ms by what was done; ``ready``: as the window is."""
    delays: dict[str, Heard] = {}
    settings = QSettings(str(folder / "x.ini"), QSettings.Format.IniFormat)
    settings.clear()
    window = MainWindow(Session(folder, settings, theme=LIGHT))
    window.session.arming.connect(collector.settle)
    if not ready:
        window.idle_pages.close()
    window.resize(1366, 768)
    window.show()
    run = window.run_page
    window.session.set_sequence(SEQUENCE, folder)
    until(lambda: window.session.preview is not None)
    if ready:
        # the comparisons with the model go on for minutes, and stop during a run
        until(lambda: window.idle_pages.done and len(window.library.summaries) >= MANY)
    run_event_loop(1.0)
    until(lambda: run.arm_button.isEnabled() and run.arm_button.answers)
    run.runner.arm(True)
    until(run.start_button.isEnabled)
    run.start()
    until(lambda: run.live is not None and run.live.now() is not None)
    run_event_loop(1.0)
    for kind in PAGES:
        if kind is not type(run) and only in kind.title:
            row = PAGES.index(kind)
            delays[kind.title] = heard(lambda row=row: window.list.setCurrentRow(row))
    for name, act in acts(window, folder) if ready else ():
        if only in name:
            delays[name] = heard(act)
    window.set_colour_scheme("light")
    window.leave()
    until(lambda: not run.runner.running)
    end(window)
    return delays


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--only", default="", help="acts whose name holds this")
    given = parser.parse_args()
    application = QApplication([])
    prepare_plots()
    collector = Collector(application)
    print("| window | page or act | presses | delay, ms: median | worst | work, ms: worst |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="dearig-stop-") as place:
        folder = Path(place)
        many_recordings(folder)
        for ready in (False, True):
            found: dict[str, Heard] = {}
            for _ in range(given.repeats):
                for title, parts in measure(ready, folder, given.only, collector).items():
                    for whole, part in zip(found.setdefault(title, ([], [])), parts, strict=True):
                        whole.extend(part)
            words = "as it is" if ready else "pages made when opened"
            for title, (delays, works) in found.items():
                late, worked = np.array(delays), np.array(works)
                row = f"| {words} | {title} | {late.size} | {np.median(late):.1f} |"
                print(f"{row} {late.max():.0f} | {worked.max():.0f} |", flush=True)
    collector.close()


if __name__ == "__main__":
    main()
