"""Delay of a press of STOP while a page of the window is opened for the first time.

``python -m tests.benchmarks.bench_stop [--repeats 3]``: a run on the simulated rig in real time; in
its midst each page that was not shown yet is opened, and presses of a key are sent all the time
from another thread. The delay is the time from the sending of the press to its being heard. Work is
the processor time of the window's thread between two presses that it has heard: a press waits as
long on a computer that does nothing else. The first rows are of a window that makes a page when it
is opened, the others of the window as it is.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")  # before Qt is loaded

import numpy as np
from PySide6.QtCore import QEvent, QEventLoop, QSettings, QTimer
from PySide6.QtWidgets import QApplication

from dearig.window.jobs.collector import Collector
from dearig.window.kit.theme import LIGHT, prepare_plots
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from dearig.window.shell.pages import PAGES
from tests.benchmarks.bench_window import Listener, run_event_loop

PATIENCE = 120.0  # s


class Presses(Listener):
    """Hears presses of STOP, and how long the window's thread has worked between them."""

    def __init__(self) -> None:
        self.worked: list[float] = []
        self._before = time.thread_time()
        super().__init__()

    def event(self, event: QEvent) -> bool:
        now = time.thread_time()
        self.worked.append(now - self._before)
        self._before = now
        return super().event(event)


def until(condition: Callable[[], bool]) -> None:
    """Let the window work until ``condition``."""
    late = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > late:
            raise SystemExit("the window did not get there")
        loop = QEventLoop()
        QTimer.singleShot(10, loop.quit)
        loop.exec()


def measure(ready: bool) -> dict[str, list[tuple[float, float]]]:
    """Return delays and work in ms by the page that was opened; ``ready``: as the window is."""
    delays: dict[str, list[tuple[float, float]]] = {}
    with tempfile.TemporaryDirectory(prefix="dearig-stop-") as folder:
        settings = QSettings(str(Path(folder, "x.ini")), QSettings.Format.IniFormat)
        window = MainWindow(Session(Path(folder), settings, theme=LIGHT))
        if not ready:
            window.idle_pages.close()
        window.resize(1366, 768)
        window.show()
        run = window.run_page
        until(lambda: window.session.preview is not None)
        if ready:
            until(lambda: window.idle_pages.done)
        run_event_loop(1.0)
        until(lambda: run.arm_button.isEnabled() and run.arm_button.answers)
        run.runner.arm(True)
        until(run.start_button.isEnabled)
        run.start()
        until(lambda: run.live is not None and run.live.now() is not None)
        run_event_loop(1.0)
        for kind in PAGES:
            if kind is type(run):
                continue
            listener = Presses()
            run_event_loop(0.2)
            window.list.setCurrentRow(PAGES.index(kind))
            run_event_loop(0.8)
            listener.close()
            run_event_loop(0.05)
            pairs = zip(listener.delays, listener.worked, strict=False)
            delays[kind.title] = [(1e3 * d, 1e3 * w) for d, w in pairs]
        window.leave()
        until(lambda: not run.runner.running)
        window.leave()
    return delays


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    given = parser.parse_args()
    application = QApplication([])
    prepare_plots()
    collector = Collector(application)
    print("| window | page | presses | delay, ms: median | worst | work, ms: worst |")
    print("|---|---|---|---|---|---|")
    for ready in (False, True):
        found: dict[str, list[tuple[float, float]]] = {}
        for _ in range(given.repeats):
            for title, delays in measure(ready).items():
                found.setdefault(title, []).extend(delays)
        words = "as it is" if ready else "pages made when opened"
        for title, delays in found.items():
            late, worked = np.array(delays).T
            row = f"| {words} | {title} | {late.size} | {np.median(late):.1f} | {late.max():.0f} |"
            print(f"{row} {worked.max():.0f} |", flush=True)
    collector.close()


if __name__ == "__main__":
    main()
