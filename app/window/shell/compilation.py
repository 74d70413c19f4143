"""The first start: the model is compiled once, in another process, with a bar that says so."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, QTimer, Signal, Slot
from PySide6.QtWidgets import QFrame, QHBoxLayout, QProgressBar, QWidget

from dearig.acquisition.warm_up import compile_kernels, has_cache, is_warm, kernels_compiled
from dearig.window.jobs.background import Background
from dearig.window.jobs.worker import Job, Worker
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import ElidedLabel

__all__ = ["Compilation", "CompilationBar"]

_LOOK = 500  # ms between two looks at the kernels that are compiled


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
        self._before = 0  # kernels that were in the cache
        self._running = False
        self._job: Job | None = None
        self._worker = Worker(self)
        self._thread = Background(self)
        self._thread.done.connect(self._finished)
        self._thread.failed.connect(self._failed)
        self._look = QTimer(self, interval=_LOOK)
        self._look.timeout.connect(self.progressed)

    @property
    def running(self) -> bool:
        """True while kernels are compiled."""
        return self._running

    @property
    def seconds(self) -> float:
        """Time in s since the compilation began."""
        return self._clock() - self._began

    @property
    def kernels(self) -> int:
        """Number of kernels that were compiled since then."""
        return kernels_compiled() - self._before

    def start(self) -> bool:
        """Begin, and return True; return False where nothing is to be compiled."""
        if self._running or not self._needed():
            return False
        self._running, self._began = True, self._clock()
        self._before = kernels_compiled()
        if self._has_cache():
            self._job = job = self._worker.submit(self._work)
            job.finished.connect(self._finished)
            job.failed.connect(self._failed)
        else:
            self._thread.start(self._work)
        self._look.start()
        self.running_changed.emit(True)
        return True

    def close(self) -> None:
        """End the process."""
        self._look.stop()
        self._running, self._job = False, None
        self._worker.close()
        self._thread.close()

    @Slot(object)
    def _finished(self, result: object = None) -> None:  # noqa: ARG002
        self.close()  # the process has nothing more to do
        self.running_changed.emit(False)

    @Slot(str)
    def _failed(self, sentence: str) -> None:
        self.failed.emit(f"The model could not be compiled beforehand: {sentence}")
        self._finished()


class CompilationBar(QFrame):
    """Says that the model is compiled and for how long; hidden at other times.

    How many kernels there will be is not known beforehand, so the bar shows no part of them.
    """

    def __init__(self, compilation: Compilation, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._compilation = compilation
        self.words = ElidedLabel(hugging=True)
        self.bar = QProgressBar()
        self.bar.setRange(0, 0)  # it moves without an end
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
        running = self._compilation.running
        self.setVisible(running)
        if running:
            self.words.show_text(
                f"Compiling the model once, about a minute: {self._compilation.seconds:.0f} s, "
                f"{self._compilation.kernels} functions; the plan follows"
            )
