"""Frames a second of a run that an operator sees: the path of a real run, in blocks of 0.1 s.

``python -m tests.benchmarks.bench_live [--seconds 5] [--size 1366x768]``: the page Run plays a
sequence on the simulated rig in real time. A frame counts when the curves were painted and showed
something new: other points, or a moved time axis. Rows are for a time axis that stands (the first
10 s), one that moves (last 2 s), and the whole run; once with the pace of the display (a run flows)
and once without (each block is drawn when it comes).
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path
from unittest.mock import patch

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")  # before Qt is loaded

import numpy as np
from PySide6.QtCore import QCoreApplication, QEvent, QObject, QSettings
from PySide6.QtWidgets import QApplication

from dearig.window.jobs.collector import Collector
from dearig.window.kit.theme import LIGHT, apply, prepare_plots
from dearig.window.run.pace import ShownTime
from dearig.window.run.page import RunPage
from dearig.window.sequence.planner import Planner
from dearig.window.session.state import Session
from tests.benchmarks.bench_stop import until
from tests.benchmarks.bench_window import Listener, run_event_loop

SEQUENCE = """\
name = "bench"
lead_in_s = 0.5
[[segment]]
kind = "half_sine"
amplitude_kV = 6.0
frequency_Hz = 0.5
repeats = 15
"""
SPANS = (("last 10 s, the first 10", 10.0, 0.5), ("last 2 s", 2.0, 3.0), ("whole run", None, 0.5))


class Frames(QObject):
    """Counts the paintings of the curves that show another picture than the one before."""

    def __init__(self, page: RunPage) -> None:
        super().__init__()
        self._plots = page.plots
        self._before: object = None
        self.count = 0
        page.plots.area.canvas.viewport().installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        if event.type() == QEvent.Type.Paint:
            x, _ = self._plots.curve("monitor")
            shown = (self._plots.x_range(), x.size, float(x[-1]) if x.size else 0.0)
            if shown != self._before:
                self._before = shown
                self.count += 1
        return super().eventFilter(watched, event)


def measure(
    span: float | None, after: float, seconds: float, size: tuple[int, int]
) -> tuple[float, float, float]:
    """Return frames a second, ms of one processor a frame, and the worst delay of a key in ms."""
    with tempfile.TemporaryDirectory(prefix="dearig-live-") as folder:
        settings = QSettings(str(Path(folder, "x.ini")), QSettings.Format.IniFormat)
        session = Session(Path(folder), settings, theme=LIGHT)
        session.set_sequence(SEQUENCE, Path())
        planner, page = Planner(session), RunPage(session)
        page.resize(*size)
        page.show()
        planner.renew()
        until(lambda: session.preview is not None and page.arm_button.isEnabled())
        until(lambda: page.arm_button.answers)
        page.runner.arm(True)
        until(page.start_button.isEnabled)
        page.plots.span_s = span
        page.start()
        until(lambda: (now := page.live and page.live.now()) and now.samples > after * now.rate)
        frames, listener = Frames(page), Listener()
        began, worked = time.perf_counter(), time.thread_time()
        run_event_loop(seconds)
        worked = time.thread_time() - worked
        rate = frames.count / (time.perf_counter() - began)
        listener.close()
        page.close_work()
        planner.close()
        page.close()
        page.deleteLater()
        QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)
        cost = 1e3 * worked / max(frames.count, 1)
        return rate, cost, 1e3 * float(np.max(listener.delays))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--size", default="1366x768")
    given = parser.parse_args()
    width, height = (int(part) for part in given.size.split("x"))
    application = QApplication([])
    prepare_plots()
    apply(application, LIGHT)
    collector = Collector(application)
    print(
        "| time axis | display | frames a second | ms of one processor a frame | key, worst, ms |"
    )
    print("|---|---|---|---|---|")
    for words, span, after in SPANS:
        for flows in (False, True):
            shown = ShownTime.shown if flows else (lambda _, end, __: end)
            with patch.object(ShownTime, "shown", shown):
                rate, cost, worst = measure(span, after, given.seconds, (width, height))
            how = "flows" if flows else "block by block"
            print(f"| {words} | {how} | {rate:.1f} | {cost:.1f} | {worst:.0f} |", flush=True)
    collector.close()


if __name__ == "__main__":
    main()
