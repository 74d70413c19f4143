"""The first start: the model is compiled once, in another process, with a bar that says so."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, QTimer, Signal, Slot
from PySide6.QtWidgets import QFrame, QHBoxLayout, QProgressBar, QWidget

from dearig.acquisition.warm_up import compile_kernels, has_cache, is_warm
from dearig.window.jobs.background import Background
from dearig.window.jobs.worker import Job, Worker
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import ElidedLabel

__all__ = ["Compilation", "CompilationBar"]

_FINE = 1000  # steps of the bar
_TICK = 500  # ms between two showings of the time


class Compilation(QObject):
    """Compiles the kernels of the model if this computer has not done so yet.

    ``running_changed`` carries whether it goes on; ``progressed`` follows every half second.
    ``failed`` carries a sentence: then each kernel is compiled at its first use, in this process.
    ``work`` is called in the other process, or in a thread where no cache can carry its result to
    this one (``has_cache``); ``needed`` returns whether there is something to do.
    """

    running_changed = Signal(bool)
    progressed = Signal()
    failed = Signal(str)

    def __init__(
        self,
        parent: QObject | None = None,
        *,
        work: Callable[..., Any] = compile_kernels,
        needed: Callable[[], bool] = lambda: not is_warm(),
        has_cache: Callable[[], bool] = has_cache,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(parent)
        self._work = work
        self._needed = needed
        self._has_cache = has_cache
        self._clock = clock
        self._began = 0.0
        self.stage = ""  #: as "kernel 12 of 300"; "" before the first, and where no process tells
        self.part = 0.0  #: part of the kernels that is ready, 0 to 1
        self._running = False
        self._job: Job | None = None
        self._worker = Worker(self)
        self._thread = Background(self)
        self._thread.done.connect(self._finished)
        self._thread.failed.connect(self._failed)
        self._tick = QTimer(self, interval=_TICK)
        self._tick.timeout.connect(self.progressed)

    @property
    def running(self) -> bool:
        """True while kernels are compiled."""
        return self._running

    @property
    def seconds(self) -> float:
        """Time in s since the compilation began."""
        return self._clock() - self._began

    def start(self) -> bool:
        """Begin, and return True; return False where nothing is to be compiled."""
        if self._running or not self._needed():
            return False
        self._running, self._began = True, self._clock()
        if self._has_cache():
            self._job = job = self._worker.submit(self._work)
            job.progressed.connect(self._progressed)
            job.finished.connect(self._finished)
            job.failed.connect(self._failed)
        else:
            self._thread.start(self._work)
        self._tick.start()
        self.running_changed.emit(True)
        return True

    def close(self) -> None:
        """End the process."""
        self._tick.stop()
        self._running, self._job = False, None
        self._worker.close()
        self._thread.close()

    @Slot(str, float, float)
    def _progressed(self, stage: str, part: float, _: float) -> None:
        self.stage, self.part = stage, part
        self.progressed.emit()

    @Slot(object)
    def _finished(self, result: object = None) -> None:  # noqa: ARG002
        self.close()  # the process has nothing more to do
        self.running_changed.emit(False)

    @Slot(str)
    def _failed(self, sentence: str) -> None:
        self.failed.emit(f"The model could not be compiled beforehand: {sentence}")
        self._finished()


class CompilationBar(QFrame):
    """Says that the model is compiled, how far, and for how long; hidden at other times."""

    def __init__(self, compilation: Compilation, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._compilation = compilation
        self.words = ElidedLabel(hugging=True)
        self.bar = QProgressBar()
        self.bar.setTextVisible(False)
        self.bar.setFixedHeight(10)
        self.bar.setFixedWidth(180)
        self.bar.setAccessibleName("The model is being compiled")
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(SPACE)
        row.addWidget(self.bar)
        row.addWidget(self.words, 1)
        compilation.running_changed.connect(self._refresh)
        compilation.progressed.connect(self._refresh)
        self._refresh()

    @Slot()
    def _refresh(self) -> None:
        of = self._compilation
        self.setVisible(of.running)
        if not of.running:
            return
        # without a number it moves without an end
        self.bar.setRange(0, _FINE if of.stage else 0)
        self.bar.setValue(round(of.part * _FINE))
        minutes, seconds = divmod(int(of.seconds), 60)
        stage = f"{of.stage}, " if of.stage else ""
        self.words.show_text(
            f"Compiling the model once: {stage}{minutes}:{seconds:02d}; the plan follows"
        )
