"""Frames a second and delay of a key while three channels come at the card's full rate.

``python -m tests.benchmarks.bench_window [--seconds 8] [--size 1366x768]``: the window's own plots
of a run against a plain pyqtgraph plot of the same samples, with and without its settings for many
points. Samples come in blocks of a tenth of a second, in real time, and are turned into curves in
a thread of their own, as in a run. What stands in the first column was drawn in full: a frame
counts when it was painted. The delay is from a key's being sent to its being heard.
"""

from __future__ import annotations

import argparse
import os
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")  # before Qt is loaded

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QCoreApplication, QEvent, QEventLoop, QObject, QSettings, Qt, QTimer
from PySide6.QtGui import QPaintEvent
from PySide6.QtWidgets import QApplication

from dearig.acquisition.plan import plan
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.channels import Channel, Scaling
from dearig.drivers.rig import Block, RigIdentity
from dearig.drivers.samples import Repeated
from dearig.window.jobs.collector import Collector
from dearig.window.kit.theme import LIGHT, apply, prepare_plots
from dearig.window.run.live import Live
from dearig.window.run.plots import RunPlots
from dearig.window.sequence.planner import make_preview
from dearig.window.session.state import Session

RATE = 1e6 / 3.0  # Hz: a million conversions a second over three inputs
BLOCK = 0.1  # s
WINDOW = 10.0  # s shown
FRAME = 16  # ms
VOLTS = Scaling((0.0, 10.0 / 32768), 1000.0)
CHANNELS = (
    Channel("voltage_command", "V", VOLTS),
    Channel("voltage_monitor", "V", VOLTS),
    Channel("current_monitor", "A", Scaling((0.0, 10.0 / 32768), 4e-3)),
    Channel("displacement", "m", Scaling((0.0, 10.0 / 32768), 4e-3)),
)
SEQUENCE = (
    'name = "bench"\nlead_in_s = 0.0\n[[segment]]\nkind = "half_sine"\namplitude_kV = 8.0\n'
    "frequency_Hz = 0.5\nrepeats = 15\n"
)


class Source:
    """Samples of a run of half a minute, block by block in real time, from a thread."""

    def __init__(self, take: Callable[[Block], None]) -> None:
        self._take = take
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        rng = np.random.default_rng(1)
        size = round(RATE * BLOCK)
        time_of = np.arange(size) / RATE
        self.counts = np.empty((len(CHANNELS), size), dtype=np.int16)
        self.counts[0] = 20_000 * np.sin(2 * np.pi * 10.0 * time_of) ** 2
        self.counts[1] = self.counts[0] + rng.integers(-8, 9, size)
        self.counts[2] = rng.integers(-8, 9, size)
        self.counts[3] = self.counts[0] // 8 + rng.integers(-8, 9, size)

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        began, start = time.perf_counter(), 0
        while not self._over.is_set():
            self._take(Block(start, self.counts))
            start += self.counts.shape[1]
            self._over.wait(max(0.0, began + start / RATE - time.perf_counter()))


class _Key(QEvent):
    KIND = QEvent.Type(QEvent.registerEventType())

    def __init__(self) -> None:
        super().__init__(self.KIND)
        self.sent = time.perf_counter()


class Listener(QObject):
    """Hears keys that another thread sends, and how long each was under way."""

    PAUSE = 0.037  #: s between two keys: never in step with the frames

    def __init__(self) -> None:
        super().__init__()
        self.delays: list[float] = []
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._send, daemon=True)
        self._thread.start()

    def event(self, event: QEvent) -> bool:
        if isinstance(event, _Key):
            self.delays.append(time.perf_counter() - event.sent)
            return True
        return super().event(event)

    def close(self) -> None:
        self._over.set()
        self._thread.join()

    def _send(self) -> None:
        while not self._over.wait(self.PAUSE):
            QCoreApplication.postEvent(self, _Key())


class Ours(RunPlots):
    frames = 0

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.area.canvas.viewport().installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        if event.type() == QEvent.Type.Paint:
            self.frames += 1
        return super().eventFilter(watched, event)


class Plain(pg.GraphicsLayoutWidget):
    """The last ten seconds, every sample of them, as the manual of pyqtgraph has it."""

    frames = 0

    def __init__(self, tuned: bool) -> None:
        super().__init__()
        self.setBackground(LIGHT.window)
        self._tuned = tuned
        self.held = 0
        self.ring = np.zeros((3, round(WINDOW * RATE)), dtype=np.float64)
        self._time = np.arange(self.ring.shape[1]) / RATE
        self._curves = []
        for row in range(3):
            plot = self.addPlot(row=row, col=0)
            curve = plot.plot(pen=pg.mkPen(LIGHT.command, width=1))
            if tuned:
                curve.setClipToView(True)
                curve.setDownsampling(auto=True, method="peak")
                curve.setSkipFiniteCheck(True)
                plot.setXRange(0.0, WINDOW)
            self._curves.append(curve)

    def take(self, block: Block) -> None:
        n = block.counts.shape[1]
        self.ring[:, :-n] = self.ring[:, n:]
        for row, channel in enumerate((0, 1, 3)):
            self.ring[row, -n:] = CHANNELS[channel].scaling.physical(block.counts[channel])
        self.held = min(self.held + n, self.ring.shape[1])

    def draw(self) -> None:
        if not self.held:
            return
        for row, curve in enumerate(self._curves):
            curve.setData(self._time[: self.held], self.ring[row, -self.held :])

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802
        super().paintEvent(event)
        self.frames += 1


def run_event_loop(seconds: float) -> None:
    loop = QEventLoop()
    QTimer.singleShot(round(1e3 * seconds), loop.quit)
    loop.exec()


def measure(
    widget: Ours | Plain,
    draw: Callable[[], None],
    source: Source,
    size: tuple[int, int],
    seconds: float,
) -> tuple[float, float, float, float]:
    """Once the window is full: frames a second, processor time of one, delays of a key.

    All but the first in ms; of the delays the median and the worst.
    """
    widget.resize(*size)
    widget.show()
    source.start()
    timer = QTimer()
    timer.setTimerType(Qt.TimerType.PreciseTimer)
    timer.timeout.connect(draw)
    timer.start(FRAME)
    run_event_loop(WINDOW + 1.0)
    listener, frames = Listener(), widget.frames
    began, worked = time.perf_counter(), time.thread_time()
    run_event_loop(seconds)
    drawn, worked = widget.frames - frames, time.thread_time() - worked
    rate = drawn / (time.perf_counter() - began)
    timer.stop()
    listener.close()
    source.close()
    widget.close()
    delays = 1e3 * np.array(listener.delays)
    cost = 1e3 * worked / max(drawn, 1)
    return rate, cost, float(np.median(delays)), float(delays.max())


def ours(models: int, window: float | None) -> tuple[Ours, Live, Source]:
    settings = QSettings(os.devnull, QSettings.Format.IniFormat)
    session = Session(Path(), settings, theme=LIGHT)
    session.set_overlays((session.thesis_model,) * models)
    live = Live(session.overlays)
    loaded = parse_sequence(SEQUENCE, "bench", Path())
    # the plan says how long the run is going to be: here ten million samples, half a minute
    still = Repeated(np.zeros(1), 10_000_000, 10_000_000)
    planned = replace(plan(loaded, RigFile()), voltage=still)
    live.started(planned, RigIdentity("sim", True, (), CHANNELS), RATE)
    plots = Ours(session)
    plots.span_s = window
    plots.show_prediction(make_preview(SEQUENCE, Path(), RigFile()))
    plots.start()
    return plots, live, Source(live.block)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--size", default="1366x768")
    given = parser.parse_args()
    width, height = (int(part) for part in given.size.split("x"))
    application = QApplication([])
    prepare_plots()
    apply(application, LIGHT)
    collector = Collector()  # as in the program
    print(f"{RATE / 1e3:.0f} kHz, {len(CHANNELS)} channels, {width} x {height}")
    print("| plots | frames a second | ms of one processor a frame | key, ms: median | worst |")
    print("|---|---|---|---|---|")

    def row(words: str, result: tuple[float, float, float, float]) -> None:
        rate, cost, median, worst = result
        print(f"| {words} | {rate:.1f} | {cost:.1f} | {median:.1f} | {worst:.0f} |", flush=True)

    for words, models, window in (
        ("ours, last 10 s, no model", 0, WINDOW),
        ("ours, last 10 s, one model", 1, WINDOW),
        ("ours, last 10 s, two models", 2, WINDOW),
        ("ours, whole run, two models", 2, None),
    ):
        plots, live, source = ours(models, window)

        def draw(plots: Ours = plots, live: Live = live) -> None:
            now = live.now()
            if now is not None:
                plots.draw(live, now.samples / now.rate)

        row(words, measure(plots, draw, source, (width, height), given.seconds))
        live.close()
    for words, tuned in (
        ("pyqtgraph, clip to view, peak downsampling, no finite check", True),
        ("pyqtgraph as it comes", False),
    ):
        plain = Plain(tuned)
        source = Source(plain.take)
        row(words, measure(plain, plain.draw, source, (width, height), given.seconds))
    collector.close()


if __name__ == "__main__":
    main()
